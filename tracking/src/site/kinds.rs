//! Each kind of part of a site, as [`Part`] has them.

use super::door::Door;
use super::floor::Floor;
use super::line::CountingLine;
use super::part::{Kind, Part};
use super::reader::{Reader, Reads};
use super::{Entry, Exclude, Module, Mover, Wall, Zone};

macro_rules! named_parts {
    ($($part:ident $kind:ident |$it:ident| $corners:expr;)*) => {
        $(impl Part for $part {
            const KIND: Kind = Kind::$kind;

            fn name(&self) -> &str {
                &self.name
            }

            fn named(&self, name: &str) -> Self {
                Self { name: name.to_owned(), ..self.clone() }
            }

            fn corners(&self) -> Vec<[f64; 2]> {
                let $it = self;
                $corners
            }
        })*
    };
}

named_parts! {
    Module Module |it| vec![[it.x, it.y]];
    Floor Floor |it| vec![[it.x, it.y]];
    Zone Zone |it| it.polygon.clone();
    Entry Entry |it| it.line.to_vec();
    CountingLine Line |it| vec![it.from, it.to];
    Mover Mover |it| it.polygon.clone();
    Exclude Exclude |it| it.polygon.clone();
    Door Door |it| it.line.to_vec();
    Reader Reader |it| match it.reads {
        Reads::Near { at, .. } => vec![[at.x, at.y]],
        Reads::Pixels { .. } => Vec::new(),
    };
}

impl Part for Wall {
    const KIND: Kind = Kind::Wall;

    fn name(&self) -> &str {
        ""
    }

    fn named(&self, _: &str) -> Self {
        self.clone()
    }

    fn corners(&self) -> Vec<[f64; 2]> {
        self.points.clone()
    }
}
