//! The panels of a floor that do not work, in words.

use kehai::floor::Fault;
use kehai::wire::FaultyPanel;

use crate::floor::unknown_from;

/// Panels named in an alarm; the map shows them all.
const NAMED: usize = 6;

/// What the newest reading of a floor says of its panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Panels {
    /// Its columns and rows.
    pub size: (u8, u8),
    /// Those that the site gives it; None if it has no place there.
    pub wanted: Option<(u8, u8)>,
    /// Panels that do not work.
    pub faulty: Vec<FaultyPanel>,
}

impl Panels {
    /// Share of the panels of which nothing is known: those named, and all behind the last one of a full list.
    pub fn unknown_share(&self) -> f64 {
        let all = u32::from(self.size.0) * u32::from(self.size.1);
        let behind = unknown_from(&self.faulty).map_or(0, |from| all.saturating_sub(from.into()));
        (self.faulty.len() as f64 + f64::from(behind)) / f64::from(all).max(1.0)
    }

    /// Which panels do not work, if any.
    pub fn fault(&self) -> Option<String> {
        let columns = u16::from(self.size.0).max(1);
        let named = |fault: Fault, what: &str| {
            let those: Vec<_> = self.faulty.iter().filter(|panel| panel.fault == fault).collect();
            let place =
                |panel: &&FaultyPanel| format!("({}, {})", panel.panel % columns, panel.panel / columns);
            let names: Vec<String> = those.iter().take(NAMED).map(place).collect();
            let more = those.len().saturating_sub(NAMED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            (!those.is_empty()).then(|| format!("{what} {}{more}", names.join(", ")))
        };
        let parts = [named(Fault::Stuck, "always down:"), named(Fault::Dead, "never down:")];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        (!parts.is_empty()).then(|| {
            let parts = parts.join("; ");
            format!("panels (column, row) {parts}: nothing is known there; take off what lies on them, or replace them")
        })
    }

    /// That its size is not that of the site, if so.
    pub fn misfit(&self) -> Option<String> {
        let (columns, rows) = self.size;
        let (wanted_columns, wanted_rows) = self.wanted.filter(|wanted| *wanted != self.size)?;
        Some(format!(
            "it has {columns} columns and {rows} rows, the site says {wanted_columns} and {wanted_rows}, and it is not used: \
             mend its [[floor]]"
        ))
    }
}

#[cfg(test)]
mod tests {
    use kehai::floor::FAULTY;

    use super::*;

    #[test]
    fn behind_the_last_of_a_full_list_nothing_is_known() {
        let dead = |panel| FaultyPanel { panel, fault: Fault::Dead };
        let panels = |faulty: u16| Panels {
            size: (20, 10),
            wanted: None,
            faulty: (0..faulty).map(|number| dead(2 * number)).collect(),
        };
        assert_eq!(panels(10).unknown_share(), 0.05);
        let full = panels(u16::try_from(FAULTY).unwrap());
        assert_eq!(full.unknown_share(), (FAULTY + 200 - (2 * FAULTY - 1)) as f64 / 200.0);
    }
}
