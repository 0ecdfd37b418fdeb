//! A site file's text for another site: what has not changed stays, with its comments and its order.
//!
//! ```text
//!   # where we live          # where we live
//!   [[zone]] # the yard      [[zone]] # the yard
//!   name = "yard"       ─▶   name = "yard"
//!   count = false # yet      count = true # yet        only what changed is written
//!                            [[zone]]                  new parts come last of their kind
//! ```

use kehai_tracking::site::Site;
use kehai_tracking::site::pairs::pairs;
use kehai_tracking::site::part::Part;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, Value};

/// First line of files that older versions saved. It is no longer true.
const OLD_HEAD: &str = "# Saved by kehai-tracker. Comments are not kept when the map saves again.\n\n";

/// First line of a file that had to be written whole.
const HEAD: &str = "# Saved by kehai-tracker. What was written otherwise before is in the file of the same name that ends in .bak1.\n\n";

/// The text of the file that says `after`, from one that says `before`.
///
/// # Errors
/// The site cannot be written as TOML.
pub fn rewritten(text: &str, before: &Site, after: &Site) -> Result<String, String> {
    let text = text.strip_prefix(OLD_HEAD).unwrap_or(text);
    if let Some(text) = edited(text, before, after)
        && Site::parse("site", &text).is_ok_and(|site| site == *after)
    {
        return Ok(text);
    }
    // Not as tables, or in an order that tables cannot have.
    toml::to_string(after).map(|body| format!("{HEAD}{body}")).map_err(|error| error.to_string())
}

/// Comments that stood before a part that was taken away, and its place in the file.
type Left = (isize, String);

fn edited(text: &str, before: &Site, after: &Site) -> Option<String> {
    // Whatever ends lines in the file, it is written with \n, and by empty lines its comments are told apart.
    let mut document: DocumentMut = text.replace("\r\n", "\n").parse().ok()?;
    let first = document
        .iter()
        .filter_map(|(_, item)| item.as_array_of_tables()?.iter().filter_map(Table::position).min());
    let first = first.min();
    let mut left = Vec::new();
    let to = &mut document;
    parts(to, &before.modules, &after.modules, &mut left)?;
    parts(to, &before.floors, &after.floors, &mut left)?;
    parts(to, &before.walls, &after.walls, &mut left)?;
    parts(to, &before.zones, &after.zones, &mut left)?;
    parts(to, &before.entries, &after.entries, &mut left)?;
    parts(to, &before.lines, &after.lines, &mut left)?;
    parts(to, &before.movers, &after.movers, &mut left)?;
    parts(to, &before.excludes, &after.excludes, &mut left)?;
    parts(to, &before.doors, &after.doors, &mut left)?;
    parts(to, &before.readers, &after.readers, &mut left)?;
    left.sort();
    for (position, comments) in left.into_iter().rev() {
        keep(to, position, &comments, Some(position) == first);
    }
    Some(document.to_string())
}

/// The parts of one kind.
fn parts<P: Part>(document: &mut DocumentMut, before: &[P], after: &[P], left: &mut Vec<Left>) -> Option<()> {
    if before == after {
        return Some(());
    }
    let key = P::KIND.key();
    let item = document.entry(key).or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    if item.is_value() {
        // [{…}, {…}] in one line: what it says stays.
        *item = std::mem::take(item).into_array_of_tables().map(Item::ArrayOfTables).ok()?;
    }
    let tables = item.as_array_of_tables_mut()?;
    let mut old: Vec<Option<Table>> = tables.iter().cloned().map(Some).collect();
    if old.len() != before.len() {
        return None;
    }
    let mut positions: Vec<isize> = Vec::new();
    let mut new: Vec<Option<Table>> = vec![None; after.len()];
    for ((table, was), is) in old.iter_mut().zip(before).zip(pairs(before, after)) {
        let mut table = table.take()?;
        match is.and_then(|is| Some((new.get_mut(is)?, after.get(is)?))) {
            Some((place, is)) => {
                change(&mut table, was, is)?;
                positions.extend(table.position());
                *place = Some(table);
            }
            None => {
                let prefix = table.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
                left.push((table.position().unwrap_or(isize::MAX), prefix.to_owned()));
            }
        }
    }
    // Tables are written by their positions: those that were there take theirs, in the new order, and a new one follows.
    positions.sort_unstable();
    let mut at = positions.first().copied();
    let mut free = positions.into_iter();
    tables.clear();
    for (table, part) in new.into_iter().zip(after) {
        let mut table = match table {
            Some(table) => {
                at = free.next().or(at);
                table
            }
            None => written(part)?,
        };
        table.set_position(at);
        tables.push(table);
    }
    if tables.is_empty() {
        document.remove(key);
    }
    Some(())
}

/// Writes what has changed of a part.
fn change<P: Part>(table: &mut Table, was: &P, is: &P) -> Option<()> {
    if was == is {
        return Some(());
    }
    let [was, is] = [was, is].map(|part| toml::Table::try_from(part).ok());
    let (was, is) = (was?, is?);
    for (key, value) in is.iter().filter(|(key, value)| was.get(*key) != Some(value)) {
        let mut new = as_value(value)?;
        match table.get_mut(key).and_then(Item::as_value_mut) {
            Some(old) => {
                // What stands around it, a comment behind it included, stays.
                *new.decor_mut() = old.decor().clone();
                *old = new;
            }
            None => {
                table.insert(key, Item::Value(new));
            }
        }
    }
    for key in was.keys().filter(|key| !is.contains_key(*key)) {
        table.remove(key);
    }
    Some(())
}

/// A part that the file does not have.
fn written<P: Part>(part: &P) -> Option<Table> {
    let mut table = Table::new();
    for (key, value) in toml::Table::try_from(part).ok()? {
        table.insert(&key, Item::Value(as_value(&value)?));
    }
    Some(table)
}

fn as_value(value: &toml::Value) -> Option<Value> {
    value.to_string().parse().ok()
}

/// Puts comments that stood before a part that is gone before the next one: all but those right above it, which go with it. What
/// stands at the head of the file is about all of it.
fn keep(document: &mut DocumentMut, position: isize, comments: &str, is_head: bool) {
    let kept = match comments.rfind("\n\n") {
        _ if is_head => comments,
        Some(end) => comments.get(..end + 1).unwrap_or_default(),
        None => return,
    };
    if kept.trim().is_empty() {
        return;
    }
    let mut next: Option<&mut Table> = None;
    for (_, item) in document.iter_mut() {
        for table in item.as_array_of_tables_mut().into_iter().flat_map(ArrayOfTables::iter_mut) {
            let at = table.position().filter(|at| *at > position);
            let best = next.as_ref().and_then(|next| next.position());
            if at.is_some_and(|at| best.is_none_or(|best| at < best)) {
                next = Some(table);
            }
        }
    }
    match next {
        Some(table) => {
            let own = table.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
            let both = format!(
                "{}\n{}",
                kept.trim_end_matches('\n').to_owned() + "\n",
                own.trim_start_matches('\n')
            );
            table.decor_mut().set_prefix(both);
        }
        None => {
            let own = document.trailing().as_str().unwrap_or_default();
            let both = format!("{kept}{own}");
            document.set_trailing(both);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOME: &str = "\
# where we live

# the kitchen's
[[module]] # above the shelf
name = \"left\"
x = 1 # by ruler
y = 2.0

# how we named rooms

# the first room
[[zone]]
name = \"hall\" # not the entrance
polygon = [[0, 0], [4, 0], [4, 4]]

[[wall]]
points = [[0, 0], [4, 0]]

# the second room
[[zone]]
name = \"study\"
polygon = [[5, 0], [9, 0], [9, 4]]
# that is all
";

    fn after(edit: impl FnOnce(&mut Site)) -> String {
        let before = Site::parse("home", HOME).unwrap();
        let mut after = before.clone();
        edit(&mut after);
        let text = rewritten(HOME, &before, &after).unwrap();
        assert_eq!(Site::parse("home", &text).unwrap(), after, "{text}");
        text
    }

    #[test]
    fn only_what_changed_is_written() {
        assert_eq!(after(|_| ()), HOME);
        let moved = after(|site| (site.modules[0].x, site.zones[0].count) = (1.25, true));
        let expected = HOME
            .replace("x = 1 # by ruler", "x = 1.25 # by ruler")
            .replace("[4, 4]]\n", "[4, 4]]\ncount = true\n");
        assert_eq!(moved, expected);
        let renamed = after(|site| site.zones[0].name = "lounge".into());
        assert_eq!(renamed, HOME.replace("\"hall\" #", "\"lounge\" #"));
    }

    #[test]
    fn new_parts_come_last_of_their_kind_and_those_taken_away_take_their_own_comment() {
        let more = after(|site| {
            let copy = |zone: &kehai_tracking::site::Zone, name: &str| {
                let mut zone = zone.clone();
                zone.name = name.into();
                zone.polygon[0] = [1.0, 1.0];
                zone
            };
            site.zones.push(copy(&site.zones[0], "attic"));
            let street = "name = \"street\"\nline = [[0, 0], [1, 0]]\nzone = \"hall\"";
            site.entries.push(toml::from_str(street).unwrap());
        });
        for line in HOME.lines() {
            assert!(more.contains(line), "{line} is not in\n{more}");
        }
        assert!(more.find("study") < more.find("attic"), "{more}");
        let less = after(|site| {
            site.zones.remove(0);
        });
        assert!(!less.contains("the first room") && !less.contains("hall"), "{less}");
        assert!(
            less.contains("# how we named rooms\n") && less.contains("# the second room\n[[zone]]"),
            "{less}"
        );
        let none = after(|site| *site = Site::default());
        for kept in ["# where we live", "# how we named rooms", "# that is all"] {
            assert!(none.contains(kept), "{kept} is not in\n{none}");
        }
    }

    #[test]
    fn comments_in_a_file_of_windows_are_kept_as_well() {
        let windows = HOME.replace('\n', "\r\n");
        let before = Site::parse("home", &windows).unwrap();
        let mut less = before.clone();
        less.zones.remove(0);
        let text = rewritten(&windows, &before, &less).unwrap();
        assert!(text.contains("# how we named rooms\n") && !text.contains("the first room"), "{text}");
        assert!(text.contains("# the second room\n[[zone]]"), "{text}");
    }

    #[test]
    fn another_order_is_kept_and_what_is_no_table_becomes_one() {
        let turned = after(|site| site.zones.reverse());
        assert!(turned.find("study") < turned.find("hall"), "{turned}");
        assert!(turned.contains("# where we live"), "{turned}");
        let text = "# mine\nzone = [{ name = \"hall\", polygon = [[0, 0], [4, 0], [4, 4]] }]\n";
        let before = Site::parse("home", text).unwrap();
        let mut now = before.clone();
        now.zones[0].count = true;
        let text = rewritten(text, &before, &now).unwrap();
        assert_eq!(Site::parse("home", &text).unwrap(), now, "{text}");
        let old = format!("{OLD_HEAD}{HOME}");
        assert_eq!(
            rewritten(&old, &Site::parse("x", HOME).unwrap(), &Site::parse("x", HOME).unwrap()).unwrap(),
            HOME
        );
    }
}
