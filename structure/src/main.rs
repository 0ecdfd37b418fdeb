//! `structure [FOLDER]`: checks the workspace in FOLDER, or in the current folder.

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    use std::process::ExitCode;

    let folder = std::env::args_os().nth(1).unwrap_or_else(|| ".".into());
    match faults(folder.as_ref()) {
        Ok(faults) if faults.is_empty() => ExitCode::SUCCESS,
        Ok(faults) => {
            faults.iter().for_each(|fault| eprintln!("{fault}"));
            eprintln!("structure: {} faults", faults.len());
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("structure: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(not(target_os = "none"))]
fn faults(folder: &std::path::Path) -> Result<Vec<String>, structure::Error> {
    let workspace = structure::layers::workspace(folder)?;
    let mut faults = structure::layers::upward(&workspace);
    faults.extend(structure::layers::heavy_core(folder)?);
    for root in structure::layers::roots(&workspace) {
        let modules = structure::modules::read(&root)?;
        faults.extend(structure::circles::find(&modules).iter().map(|circle| circle.text(folder)));
    }
    Ok(faults)
}

#[cfg(target_os = "none")]
fn main() {}
