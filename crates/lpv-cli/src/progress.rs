//! Progress on standard error: a bar on a terminal, nothing elsewhere.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` steps under `label`. Hidden when standard error is no terminal; colourless, so `NO_COLOR` holds.
pub fn bar(label: &str, length: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:28} [{bar:32}] {pos}/{len} {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ");
    ProgressBar::new(length as u64).with_style(style).with_message(label.to_owned())
}
