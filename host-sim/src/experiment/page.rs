//! Writes tables into a page of the documentation, each between its own two comments.
//!
//! ```text
//! <!-- table: standing -->          everything between the two is replaced,
//! | … |                             everything else stays as it is
//! <!-- end: standing -->
//! ```

/// Puts `text` between the comments of `table`; None where the page has no such pair.
#[must_use]
pub fn fill(page: &str, table: &str, text: &str) -> Option<String> {
    let (begin, end) = (format!("<!-- table: {table} -->\n"), format!("<!-- end: {table} -->"));
    let (before, rest) = page.split_once(&begin)?;
    let (_, after) = rest.split_once(&end)?;
    Some(format!("{before}{begin}{}\n{end}{after}", text.trim_end()))
}

#[cfg(test)]
mod tests {
    use super::fill;

    #[test]
    fn only_what_is_between_the_comments_changes() {
        let page = "a\n<!-- table: x -->\nold\n<!-- end: x -->\nb\n<!-- table: y -->\n<!-- end: y -->\n";
        let filled = fill(page, "x", "| new |\n\n").unwrap();
        assert_eq!(filled, page.replace("old", "| new |"));
        assert_eq!(fill(&filled, "x", "old").unwrap(), page);
        assert_eq!(fill(page, "z", ""), None);
        assert_eq!(fill("<!-- table: x -->\n", "x", ""), None);
    }

    #[test]
    fn the_page_of_figures_has_a_place_for_every_table() {
        let page = include_str!("../../../docs/accuracy.md");
        for table in super::super::plan::Table::EACH {
            assert!(fill(page, &table.to_string(), "").is_some(), "{table}");
        }
    }
}
