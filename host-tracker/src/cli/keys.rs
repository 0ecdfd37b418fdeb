//! `--keys`: the file with the keys of a site's modules.

use std::path::{Path, PathBuf};

use host_tracker::key_file;

use super::failure::Failure;

/// The file that was named, which must be there, or the one beside the site's, which may still be to come.
///
/// # Errors
/// There is no such file, or it cannot be used.
pub(super) fn keys_file(named: Option<&Path>, site: &Path) -> Result<PathBuf, Failure> {
    let file = named.map_or_else(|| key_file::beside(site), Path::to_path_buf);
    if key_file::load(&file)?.is_none() && named.is_some() {
        return Err(format!("{}: there is no such file", file.display()).into());
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_named_must_be_there_and_the_one_beside_the_site_need_not() {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        assert_eq!(keys_file(None, &site).unwrap(), key_file::beside(&site));
        let other = folder.path().join("other.keys");
        let error = keys_file(Some(&other), &site).unwrap_err().to_string();
        assert!(error.ends_with("other.keys: there is no such file"), "{error}");
    }
}
