//! Quality of service, as a liveliness token says it.
//!
//! ```text
//!   reliability : durability : history , depth : deadline : lifespan : liveliness
//!               :      1     :         ,   1   :    ,     :    ,     :    ,,          what is usual is left empty
//! ```
//!
//! All of ours are *reliable* and *keep last*, which is usual, and what rmw_zenoh gives a publisher of such: it sends with congestion
//! control *drop*.
//!
//! Source: rmw_zenoh, `liveliness_utils.cpp`, `qos_to_keyexpr`, and `qos.cpp` for what is usual; the numbers: `rmw/types.h`.

/// Whether those who come later are told, too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Durability {
    Volatile,
    TransientLocal,
}

/// Of a publisher.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Qos {
    pub durability: Durability,
    /// How many messages are kept, by a publisher that tells those who come later, and by a subscriber that is slow.
    pub depth: u32,
}

/// The usual depth.
const DEPTH: u32 = 42;

impl Qos {
    /// As a token has it.
    pub fn text(self) -> String {
        let durability = match self.durability {
            Durability::Volatile => "",
            Durability::TransientLocal => "1",
        };
        let depth = if self.depth == DEPTH { String::new() } else { self.depth.to_string() };
        format!(":{durability}:,{depth}:,:,:,,")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_not_usual_is_said() {
        let text = |durability, depth| Qos { durability, depth }.text();
        assert_eq!(text(Durability::Volatile, 42), "::,:,:,:,,");
        assert_eq!(text(Durability::Volatile, 10), "::,10:,:,:,,");
        assert_eq!(text(Durability::TransientLocal, 1), ":1:,1:,:,:,,");
    }
}
