//! `kehai-sim replay --site`: several recordings together, through modules and tracker.

use std::error::Error;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use host_sim::baselines::Choice;
use host_sim::jsonl::CandidatesLine;
use host_sim::replay::{Identity, Learn, identities};
use host_sim::run::TICK_US;
use host_sim::run::recorded::Recorded;
use kehai_emulator::recording::Recording;
use kehai_tracking::jsonl::{TracksLine, write_line};
use kehai_tracking::site::Site;
use kehai_tracking::tracker::LifeCycle;

use super::scene::write;

/// What is to be played, and how.
pub struct Together<'a> {
    pub site: &'a Path,
    /// `NAME=FILE`.
    pub files: &'a [String],
    pub learn: Learn,
    pub tracker: Choice,
    pub out: Option<&'a Path>,
    pub json: bool,
}

/// A module of the site and its recording.
struct Played {
    name: String,
    path: PathBuf,
    scans: usize,
}

impl Together<'_> {
    /// Does it. `done` is told of every module, of how many.
    pub fn run(&self, mut done: impl FnMut(usize, usize)) -> Result<(), Box<dyn Error>> {
        let site_name = self.site.display().to_string();
        let text = std::fs::read_to_string(self.site).map_err(|error| format!("{site_name}: {error}"))?;
        let site = Site::parse(&site_name, &text)?;
        let (mut played, mut recordings) = (Vec::<Played>::new(), Vec::new());
        for text in self.files {
            let (name, path) = text.split_once('=').ok_or_else(|| {
                format!("{text}: with --site every recording is NAME=FILE.csv, NAME a module of {site_name}")
            })?;
            if played.iter().any(|other| other.name == name) {
                return Err(format!("{text}: \"{name}\" has a recording already").into());
            }
            let path = PathBuf::from(path);
            let recording = Recording::open(&path)?;
            played.push(Played { name: name.to_owned(), path, scans: recording.scans.len() });
            recordings.push((name.to_owned(), recording));
        }
        let mut ready = 0;
        let recorded = Recorded::play(&site, &recordings, self.learn, || {
            ready += 1;
            done(ready, played.len());
        })
        .map_err(|error| format!("{site_name}: {error}"))?;
        let mut tracks = recorded.record.tracks_lines(self.tracker);
        for line in &mut tracks {
            line.t = recorded.recorded_s(line.t);
        }
        let mut candidates = recorded.record.candidates_lines();
        for line in &mut candidates {
            line.t = recorded.recorded_s(line.t);
        }
        if let Some(folder) = self.out {
            std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
            write(&folder.join("candidates.jsonl"), &candidates)?;
            write(&folder.join("tracks.jsonl"), &tracks)?;
        }
        let mut out = BufWriter::new(std::io::stdout().lock());
        if self.json {
            tracks.iter().try_for_each(|line| write_line(&mut out, line))?;
        } else {
            self.summarise(&mut out, &played, &candidates, &tracks)?;
        }
        Ok(out.flush()?)
    }

    fn summarise(
        &self,
        out: &mut impl Write,
        played: &[Played],
        candidates: &[CandidatesLine],
        tracks: &[TracksLine],
    ) -> std::io::Result<()> {
        for Played { name, path, scans } in played {
            let own = || candidates.iter().filter(|line| line.module == *name);
            let with_any = own().filter(|line| !line.candidates.is_empty()).count();
            writeln!(
                out,
                "{name}: {} of {scans} scans reached the tracker, {with_any} with a candidate  ({})",
                own().count(),
                path.display()
            )?;
        }
        let found = identities(tracks, TICK_US as f64 * 1e-6);
        let (Some(first), Some(last)) = (tracks.first(), tracks.last()) else { return Ok(()) };
        let counted = |line: &TracksLine| {
            line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative).count()
        };
        writeln!(
            out,
            "tracker {}: {} identities from {:.1} s to {:.1} s, at most {} at once",
            self.tracker,
            found.len(),
            first.t,
            last.t,
            tracks.iter().map(counted).max().unwrap_or(0)
        )?;
        for Identity { id, first_s, last_s, confirmed_s } in found {
            writeln!(out, "  {id}: seen for {confirmed_s:.1} s, between {first_s:.1} s and {last_s:.1} s")?;
        }
        if let Some(folder) = self.out {
            writeln!(out, "  candidates.jsonl and tracks.jsonl are in {}", folder.display())?;
        }
        Ok(())
    }
}
