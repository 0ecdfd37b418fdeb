//! Closed sets whose members have names for programs: each member stands once, with its name.

/// An enum, the list of its variants with their names, and the way from the one to the other.
macro_rules! named {
    (
        $(#[$about:meta])*
        $visibility:vis enum $set:ident {
            $($(#[$about_variant:meta])* $variant:ident = $name:literal,)+
        }
    ) => {
        $(#[$about])*
        $visibility enum $set {
            $($(#[$about_variant])* $variant,)+
        }

        impl $set {
            /// All of them, by their names.
            $visibility const NAMED: [(Self, &'static str); [$($name),+].len()] =
                [$((Self::$variant, $name)),+];

            /// Its name.
            #[must_use]
            $visibility const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }

            /// That of a name.
            #[must_use]
            $visibility fn named(name: &str) -> Option<Self> {
                Self::NAMED.into_iter().find(|(_, known)| *known == name).map(|(member, _)| member)
            }
        }
    };
}

pub(crate) use named;
