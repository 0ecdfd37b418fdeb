//! What a request needs, and the holder of a key may.
//!
//! ```text
//!   0 label    gives a device its first keys, nothing else
//!   1 read  <  2 raw  <  3 control
//! ```

/// What the holder of a key may do: each may do all that the one before may, but for the label.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Role {
    /// The secret on the label: gives a device without keys its first ones, nothing else.
    Label,
    /// Reports, health and profiles.
    Read,
    /// Raw scans, which show more of people.
    Raw,
    /// Settings, learning, absorbing, starting anew, and keys.
    Control,
}

impl From<Role> for u8 {
    fn from(role: Role) -> Self {
        match role {
            Role::Label => 0,
            Role::Read => 1,
            Role::Raw => 2,
            Role::Control => 3,
        }
    }
}

impl Role {
    /// The role of a key, by its code. None has that of the label.
    pub(crate) const fn of(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Read,
            2 => Self::Raw,
            3 => Self::Control,
            _ => return None,
        })
    }
}
