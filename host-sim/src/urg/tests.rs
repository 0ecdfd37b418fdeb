//! Transcripts with an emulated sensor.
use super::*;
