//! Colours and type, readable in print and for colour-blind eyes.

/// The sheet.
pub const PAPER: &str = "#fcfcfa";

/// One style sheet for everything drawn.
pub const STYLE: &str = "
text { font-family: 'DejaVu Sans', Helvetica, Arial, sans-serif; fill: #1d2430; font-size: 13px; }
.title { font-size: 22px; font-weight: 600; }
.small { font-size: 14px; fill: #4a5568; }
.axis { font-size: 12px; fill: #718096; }
.grid { stroke: #e3e6ea; stroke-width: 1; fill: none; }
.seen { fill: #eef3f7; stroke: none; }
.open { fill: #f6f1e4; stroke: none; }
.unknown { fill: #ead6d6; stroke: none; }
.wall { fill: #2d3748; stroke: none; }
.near { fill: #8d6bb8; stroke: none; }
.limit { fill: #c9a94a; stroke: none; }
.wide { stroke: #1d2430; stroke-width: .5; }
.narrow { fill: none; stroke-width: 1.4; }
.truth { fill: none; stroke: #d1495b; stroke-width: 1.2; }
.sensor { fill: #d1495b; stroke: none; }
";

/// Colour of a moment between the start (0) and the end (1): dark blue over green to yellow.
#[must_use]
pub fn at(share: f64) -> String {
    const STOPS: [[f64; 3]; 5] = [
        [59.0, 28.0, 110.0],
        [49.0, 84.0, 150.0],
        [31.0, 142.0, 140.0],
        [90.0, 190.0, 88.0],
        [235.0, 200.0, 30.0],
    ];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    let part = place - below as f64;
    let mix = |i: usize| (STOPS[below][i] + (STOPS[below + 1][i] - STOPS[below][i]) * part).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}
