//! `kehai-sim replay --floor`: recorded frames of a SensFloor through device and tracker.

use std::error::Error;
use std::io::{BufWriter, Write};
use std::path::Path;

use host_sim::floor::replay::{FloorReplay, LINE_US, layout_of};
use host_sim::replay::{Identity, identities};
use kehai::device::Settings;
use kehai::floor::FAULTY;
use kehai::floor::sensfloor::Layout;
use kehai_emulator::recording::floor::FloorRecording;
use kehai_tracking::jsonl::{TracksLine, write_line};
use kehai_tracking::tracker::LifeCycle;

/// Reads the tiles of a floor, as the setting of a device is written.
///
/// # Errors
/// What is wrong, for a person.
pub fn layout(text: &str) -> Result<Layout, String> {
    let settings = Settings::new().changed_by(&format!("tiles={text}"));
    settings.ok().and_then(|settings| settings.tiles).ok_or_else(|| {
        "a floor is GROUP,X,Y,COLUMNS,ROWS: its group, its first tile, and at most 64 tiles in all".to_owned()
    })
}

/// Plays a recording and prints it.
pub fn run(path: &Path, layout: Option<Layout>, json: bool) -> Result<(), Box<dyn Error>> {
    let recording = FloorRecording::open(path)?;
    let name = path.display();
    let layout = match layout {
        Some(layout) => layout,
        None => layout_of(&recording.frames).map_err(|error| format!("{name}: {error}"))?,
    };
    let replay = FloorReplay::run(&recording, &layout)?;
    let all = recording.frames.len();
    if replay.foreign as usize == all {
        let group = layout.group();
        return Err(format!(
            "{name}: no frame is of the floor's tiles and of group {group}; without --tiles it is found"
        )
        .into());
    }
    let mut out = BufWriter::new(std::io::stdout().lock());
    if json {
        replay.lines.iter().try_for_each(|line| write_line(&mut out, line))?;
    } else {
        summarise(&mut out, path, all, &layout, &replay)?;
    }
    Ok(out.flush()?)
}

fn summarise(
    out: &mut impl Write,
    path: &Path,
    frames: usize,
    layout: &Layout,
    replay: &FloorReplay,
) -> std::io::Result<()> {
    let ((columns, rows), (x, y)) = (layout.tiles(), layout.first());
    writeln!(
        out,
        "{}: {frames} frames, {} of other floors, {} damaged; group {}, {columns} × {rows} tiles from ({x}, {y}) on",
        path.display(),
        replay.foreign,
        replay.damaged,
        layout.group()
    )?;
    let more = if replay.faulty >= FAULTY { " or more" } else { "" };
    let faulty = match replay.faulty {
        _ if replay.readings == 0 => "nothing is known of the floor".to_owned(),
        0 => "all panels worked at the end".to_owned(),
        count => format!("{count}{more} panels were silent or stuck at the end: nothing is known there"),
    };
    writeln!(out, "  {} readings reached the tracker; {faulty}", replay.readings)?;
    let confirmed =
        |line: &TracksLine| line.tracks.iter().filter(|track| track.state == LifeCycle::Confirmed).count();
    let found = identities(&replay.lines, LINE_US as f64 * 1e-6);
    let (Some(first), Some(last)) = (replay.lines.first(), replay.lines.last()) else { return Ok(()) };
    // A line without people is of an empty floor only where its zone says so.
    let is_empty =
        |line: &&TracksLine| confirmed(line) == 0 && line.zones.values().all(|zone| zone.count() == Some(0));
    let share = |those: usize| 100.0 * those as f64 / replay.lines.len() as f64;
    let count =
        |wanted: fn(usize) -> bool| replay.lines.iter().filter(|line| wanted(confirmed(line))).count();
    let (none, empty) = (count(|people| people == 0), replay.lines.iter().filter(is_empty).count());
    writeln!(
        out,
        "  {} identities from {:.1} s to {:.1} s; one in {:.1} % of the time, more in {:.1} %, empty in {:.1} %, unknown in {:.1} %",
        found.len(),
        first.t,
        last.t,
        share(count(|people| people == 1)),
        share(count(|people| people > 1)),
        share(empty),
        share(none - empty)
    )?;
    for Identity { id, first_s, last_s, confirmed_s } in found {
        writeln!(out, "  {id}: seen for {confirmed_s:.1} s, between {first_s:.1} s and {last_s:.1} s")?;
    }
    Ok(())
}
