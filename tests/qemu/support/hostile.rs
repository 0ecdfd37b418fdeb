//! Hostile values of the settings: the same ones in each run.
//!
//! ```text
//!   edges of the key │ shapes of a number │ odd texts │ forms of the line, each with such a value │ pseudo-random ones
//!   └ 200 values of each key; a share of n takes every (200 / n)th, so it has some of each sort
//! ```

/// Values of each key.
pub const VALUES: usize = 200;

/// What a key's values are made of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sort {
    /// A number between these.
    Number(u32, u32),
    Name,
    Tiles,
    Address,
    Hosts,
}

/// Every setting of docs/wire.md.
pub const KEYS: [(&str, Sort); 11] = [
    ("name", Sort::Name),
    ("foreground_mm", Sort::Number(100, 1000)),
    ("open_range_mm", Sort::Number(500, 60_000)),
    ("learn_scans", Sort::Number(30, 6000)),
    ("first_step", Sort::Number(0, 9999)),
    ("last_step", Sort::Number(0, 9999)),
    ("cluster", Sort::Number(1, 99)),
    ("skip", Sort::Number(0, 9)),
    ("tiles", Sort::Tiles),
    ("address", Sort::Address),
    ("hosts", Sort::Hosts),
];

/// Odd for every key.
const ODD: [&str; 34] = [
    "",
    " ",
    "\0",
    "\r",
    "\t1",
    "1\0",
    "1\r",
    " 1",
    "1 ",
    "-1",
    "-0",
    "+1",
    "007",
    "1.5",
    "1e3",
    "0x10",
    "1,2",
    "=",
    "1=1",
    "auto",
    "AUTO",
    "auto ",
    "dhcp",
    "NaN",
    "65535",
    "65536",
    "4294967296",
    "18446744073709551616",
    "-2147483648",
    "١٢",
    "１０",
    "\u{202e}1\u{7f}",
    "💥\u{1b}[2J",
    "%s%n%x",
];

/// Network, loopback, multicast, broadcast and reserved addresses; those of hosts, near and far; and what is none.
const ADDRESSES: [&str; 34] = [
    "0.0.0.0",
    "0.0.0.1",
    "1.0.0.1",
    "10.0.2.15",
    "10.0.2.2",
    "10.0.2.3",
    "10.0.2.0",
    "10.0.2.255",
    "10.0.7.7",
    "127.0.0.1",
    "127.255.255.254",
    "169.254.0.1",
    "169.254.7.7",
    "172.16.0.1",
    "192.168.0.0",
    "192.168.0.255",
    "192.168.1.77",
    "192.0.2.1",
    "223.255.255.254",
    "224.0.0.1",
    "224.0.0.251",
    "239.255.255.250",
    "240.0.0.1",
    "255.255.255.254",
    "255.255.255.255",
    "256.0.0.1",
    "1.2.3",
    "1.2.3.4.5",
    "-1.2.3.4",
    "01.02.03.04",
    "1.2.3.4 ",
    "fe80::1",
    "10.0.0.٧",
    "",
];
const PREFIXES: [&str; 16] = [
    "/24",
    "/30",
    "/8",
    "/16",
    "/1",
    "/29",
    "",
    "/",
    "/0",
    "/31",
    "/32",
    "/33",
    "/256",
    "/-1",
    "/24/24",
    "/99999999999",
];
const GATEWAYS: [&str; 8] =
    ["", ",10.0.2.2", ",192.168.1.1", ",10.0.7.1", ",0.0.0.0", ",224.0.0.1", ",255.255.255.255", ","];

/// Deterministic: Steele's SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    fn value(&mut self, sort: Sort) -> String {
        match sort {
            Sort::Number(least, most) => match self.below(3) {
                0 => u64::to_string(&(self.next() >> self.below(64))),
                _ => (least as usize + self.below((most - least) as usize + 1)).to_string(),
            },
            Sort::Name => {
                let characters = ['a', 'Z', ' ', '"', '<', '\u{1b}', 'ü', '💥', '\u{202e}', '=', '\0'];
                (0..self.below(40))
                    .map(|_| self.of(&characters[..if self.0.is_multiple_of(2) { 5 } else { 11 }]))
                    .collect()
            }
            // Half of them few enough.
            Sort::Tiles => {
                let side = if self.below(2) == 0 { 8 } else { 300 };
                let group = self.next() >> 47;
                let [x, y] = [300; 2].map(|bound| self.below(bound));
                let [columns, rows] = [side; 2].map(|bound| self.below(bound + 1));
                format!("{group},{x},{y},{columns},{rows}")
            }
            // Half of them valid, and most of those wrong for the network.
            Sort::Address if self.below(2) == 0 => {
                let hosts = [1, 2, 10, 172, 192, 223]
                    .map(|net| format!("{net}.{}.{}", self.below(256), self.below(256)));
                format!("{}.{}/{}", self.of(&hosts.each_ref()), 1 + self.below(254), 1 + self.below(24))
            }
            Sort::Address => [self.of(&ADDRESSES), self.of(&PREFIXES), self.of(&GATEWAYS)].concat(),
            Sort::Hosts => {
                let hosts: Vec<_> = (0..self.below(10)).map(|_| self.of(&ADDRESSES[2..20])).collect();
                hosts.join(",")
            }
        }
    }
}

/// The edges of the values that are taken.
fn edges(sort: Sort) -> Vec<String> {
    match sort {
        Sort::Number(least, most) => [i64::from(least) - 1, least.into(), most.into(), i64::from(most) + 1]
            .map(|edge| edge.to_string())
            .into(),
        Sort::Name => [1, 31, 32, 33, 255, 256, 1000].map(|length| "n".repeat(length)).into(),
        Sort::Tiles => [
            "none",
            "10,1,1,6,4",
            "65535,0,0,64,1",
            "65536,0,0,64,1",
            "10,245,245,8,8",
            "10,246,245,8,8",
            "10,1,1,9,8",
            "10,1,1,0,4",
            "10,1,1,6",
            "10,1,1,6,4,2",
            "10,,1,6,4",
        ]
        .map(str::to_owned)
        .into(),
        Sort::Address => {
            let usual = ADDRESSES.map(|address| format!("{address}/24")).into_iter();
            usual
                .chain(PREFIXES.map(|prefix| format!("10.0.2.15{prefix}")))
                .chain([
                    "10.0.2.15/24,10.0.2.2".into(),
                    "10.0.2.15/24,10.0.2.15".into(),
                    "10.0.2.15/24,10.0.2.255".into(),
                    "10.0.2.15/24,10.0.3.2".into(),
                ])
                .collect()
        }
        Sort::Hosts => {
            let usual = ADDRESSES.map(str::to_owned).into_iter();
            usual.chain([1, 7, 8, 9, 60].map(|count| vec!["10.0.2.2"; count].join(","))).collect()
        }
    }
}

/// The line of `value`, written in one of several ways; some are no line at all.
fn form(number: usize, key: &str, value: &str, other: &str) -> Vec<u8> {
    match number % 13 {
        0 => format!("{key}={value}\n{key}={other}"),
        1 => format!("{key}={other}\n{key}={value}\n"),
        2 => format!("\n\n{key}={value}\n\n\n"),
        3 => format!("{key}={value}\r\n"),
        4 => format!("{key}{value}"),
        5 => format!("{}={value}", key.to_uppercase()),
        6 => format!(" {key}={value}"),
        7 => format!("{key} = {value}"),
        8 => format!("{key}={value}\nspeed=3"),
        9 => format!("{key}={}", other.repeat(1 + 900 / (1 + other.len()))),
        // Longer than any settings may be.
        10 => format!("{key}={value}\n").repeat(1 + 1100 / (key.len() + value.len() + 2)),
        // Not UTF-8.
        11 => return [key.as_bytes(), b"=\xff\xc0", value.as_bytes()].concat(),
        _ => format!("skip=1\n{key}={value}\ncluster=2\n{key}={other}\nskip=0\ncluster=1"),
    }
    .into_bytes()
}

/// The texts for one setting: `count` of its [`VALUES`].
pub fn texts(key: &str, sort: Sort, count: usize) -> Vec<Vec<u8>> {
    let mut random = Random(key.bytes().fold(0, |sum: u64, byte| sum << 8 ^ sum >> 56 ^ u64::from(byte)));
    let plain = |value: &str| format!("{key}={value}").into_bytes();
    let mut all: Vec<_> = edges(sort).iter().map(|value| plain(value)).collect();
    all.extend(ODD.iter().map(|value| plain(value)));
    for number in 0.. {
        if all.len() >= VALUES {
            break;
        }
        let (value, other) = (random.value(sort), random.value(sort));
        all.push(if number % 2 == 0 { plain(&value) } else { form(number / 2, key, &value, &other) });
    }
    let count = count.clamp(1, VALUES);
    let stride = VALUES / count;
    // One of each stretch, at another place of each.
    (0..count).map(|at| all[at * VALUES / count + at * 7 % stride].clone()).collect()
}
