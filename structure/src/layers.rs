//! The order of the crates, and what each may depend on.
//!
//! ```text
//!   host-sim ------> host-tracker (optional: the demo)
//!      |                  |
//!      |     +------------+
//!      v     v            v
//!   kehai-emulator   kehai-tracking        neither knows the other; kehai-depth, a device
//!           \          /                  made of frames, is beside them, on kehai-emulator
//!             v      v
//!              kehai                       its tests alone use kehai-emulator
//! ```

use std::path::{Path, PathBuf};
use std::process::Command;

use cargo_metadata::{CargoOpt, DependencyKind, Metadata, MetadataCommand, TargetKind};

use crate::Error;

/// What one crate of the workspace may depend on, of the workspace.
struct Layer {
    name: &'static str,
    normal: &'static [&'static str],
    /// In its own tests, benchmarks and examples, besides.
    tests: &'static [&'static str],
}

/// Every crate, lowest first. A crate that is not here has no place yet, which is a fault.
const LAYERS: [Layer; 8] = [
    Layer { name: "test-support", normal: &[], tests: &[] },
    Layer { name: "kehai", normal: &[], tests: &["kehai-emulator", "test-support"] },
    Layer { name: "kehai-emulator", normal: &["kehai"], tests: &[] },
    Layer { name: "kehai-depth", normal: &["kehai", "kehai-emulator"], tests: &["test-support"] },
    Layer { name: "kehai-tracking", normal: &["kehai"], tests: &[] },
    Layer {
        name: "host-tracker",
        normal: &["kehai", "kehai-tracking"],
        tests: &["kehai-emulator", "host-sim", "test-support"],
    },
    Layer {
        name: "host-sim",
        normal: &["kehai", "kehai-emulator", "kehai-depth", "kehai-tracking", "host-tracker"],
        tests: &["test-support"],
    },
    Layer { name: "structure", normal: &[], tests: &[] },
];

/// What only the daemon needs, and `cargo test -p kehai` must not build.
const DAEMON_ONLY: [&str; 5] = ["rusqlite", "parquet", "axum", "rumqttc", "mcap"];

/// The manifests of the workspace at `folder`.
///
/// # Errors
///
/// When `cargo metadata` fails.
pub fn workspace(folder: &Path) -> Result<Metadata, Error> {
    let mut command = MetadataCommand::new();
    Ok(command.current_dir(folder).no_deps().features(CargoOpt::AllFeatures).exec()?)
}

/// One line for each dependency that points upward or sideways, and for each crate without a place.
#[must_use]
pub fn upward(workspace: &Metadata) -> Vec<String> {
    let members = workspace.workspace_packages();
    let mut faults = Vec::new();
    for package in &members {
        let Some(layer) = LAYERS.iter().find(|layer| layer.name == package.name.as_str()) else {
            faults.push(format!(
                "crate {}: has no place in the order of structure/src/layers.rs",
                package.name
            ));
            continue;
        };
        for dependency in &package.dependencies {
            let name = dependency.name.as_str();
            let in_tests = dependency.kind == DependencyKind::Development;
            let allowed = layer.normal.contains(&name) || in_tests && layer.tests.contains(&name);
            if !allowed && members.iter().any(|member| member.name.as_str() == name) {
                let place = if in_tests { "dev-dependency" } else { "dependency" };
                faults.push(format!(
                    "crate {}: {place} on {name} is against the order of the crates",
                    layer.name
                ));
            }
        }
    }
    faults
}

/// One line for each library of the daemon that the core or its tests would build.
///
/// # Errors
///
/// When `cargo tree` fails.
pub fn heavy_core(folder: &Path) -> Result<Vec<String>, Error> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["tree", "-p", "kehai", "-e", "normal,dev", "--prefix", "none", "--format", "{p}"])
        .current_dir(folder)
        .output()
        .map_err(|error| Error::Tree(error.to_string()))?;
    if !output.status.success() {
        return Err(Error::Tree(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let tree = String::from_utf8_lossy(&output.stdout);
    let built = |name: &&str| tree.lines().any(|line| line.split(' ').next() == Some(name));
    let line = |name| format!("crate kehai: its tests build {name}, which only the daemon needs");
    Ok(DAEMON_ONLY.into_iter().filter(built).map(line).collect())
}

/// The root file of each library and program of the workspace.
#[must_use]
pub fn roots(workspace: &Metadata) -> Vec<PathBuf> {
    let targets = workspace.workspace_packages().into_iter().flat_map(|package| &package.targets);
    let built =
        |kinds: &[TargetKind]| kinds.iter().any(|kind| matches!(kind, TargetKind::Lib | TargetKind::Bin));
    targets.filter(|target| built(&target.kind)).map(|target| target.src_path.clone().into()).collect()
}
