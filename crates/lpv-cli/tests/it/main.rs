//! The program as a user meets it: files and arguments in; files, messages and exit codes out.

mod arrows;
mod bad_input;
mod compleib;
mod mutated;
mod polytopes;
mod problems;
mod program;
mod run;
mod sdp;
mod soundness;
mod stages;
mod step_bounds;
mod thesis;
mod trade_off;
mod transformation;
mod transformed;
