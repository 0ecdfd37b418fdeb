//! `kehai-sim demo`.
mod view;
