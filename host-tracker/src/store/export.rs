//! What happened, as CSV files for other programs.
//!
//! ```text
//!   paths.csv    run,track,time,x_m,y_m,hidden     the stored points; between two, people went straight
//!   counts.csv   zone,time,count,state
//!   events.csv   time,kind,subject,track,text      times in seconds since 1970
//! ```

use std::io::Write;
use std::path::Path as File;

use super::StoreError;
use super::reader::Reader;

/// Writes what happened between `from_ms` and `to_ms` into three files of `folder`, which is made if missing.
///
/// # Errors
/// A file cannot be written, or the database not be read.
pub fn export(database: &File, folder: &File, from_ms: u64, to_ms: u64) -> Result<(), StoreError> {
    let failed = |error| StoreError::File { file: folder.to_path_buf(), error };
    let refused = |error| StoreError::Sqlite { file: database.to_path_buf(), error };
    let reader = Reader::open(database)?;
    std::fs::create_dir_all(folder).map_err(failed)?;
    let create =
        |name: &str| std::fs::File::create(folder.join(name)).map(std::io::BufWriter::new).map_err(failed);
    let seconds = |at_ms: u64| at_ms as f64 * 1e-3;
    let mut out = create("paths.csv")?;
    writeln!(out, "run,track,time,x_m,y_m,hidden").map_err(failed)?;
    for path in reader.paths(from_ms, to_ms).map_err(refused)? {
        for place in &path.places {
            let (x_m, y_m) = (f64::from(place.x_mm) * 1e-3, f64::from(place.y_mm) * 1e-3);
            let (time_s, hidden) = (seconds(place.at_ms), u8::from(place.hidden));
            writeln!(out, "{},{},{time_s:.3},{x_m:.3},{y_m:.3},{hidden}", path.run, path.track)
                .map_err(failed)?;
        }
    }
    out.flush().map_err(failed)?;
    let mut out = create("counts.csv")?;
    writeln!(out, "zone,time,count,state").map_err(failed)?;
    for count in reader.counts(from_ms, to_ms).map_err(refused)? {
        writeln!(out, "{},{:.3},{},{}", quoted(&count.zone), seconds(count.at_ms), count.count, count.state)
            .map_err(failed)?;
    }
    out.flush().map_err(failed)?;
    let mut out = create("events.csv")?;
    writeln!(out, "time,kind,subject,track,text").map_err(failed)?;
    for event in reader.events(from_ms, to_ms).map_err(refused)? {
        let track = event.track.map(|track| track.to_string()).unwrap_or_default();
        let (subject, text) = (quoted(&event.subject), quoted(&event.text));
        writeln!(out, "{:.3},{},{subject},{track},{text}", seconds(event.at_ms), event.kind)
            .map_err(failed)?;
    }
    out.flush().map_err(failed)
}

/// As RFC 4180 has it: between quotes, and quotes doubled, if it holds a comma, a quote or a line's end.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.into()
    }
}
