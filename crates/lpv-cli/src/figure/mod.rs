//! Static figures as scalable vector graphics: axes, curves, regions, legends outside the data, light and dark.
//!
//! A [`Figure`] is plain data; [`Figure::svg`] draws it. Colours are variables of the style sheet [`STYLE`], so that a figure
//! follows the reader's colour scheme, alone in a file as well as within a page that holds the sheet.

mod axis;
mod curve;
mod drawing;
mod panel;
mod sheet;
mod space;
mod style;

pub use axis::Axis;
pub use drawing::escaped;
pub use panel::Panel;
pub use sheet::Figure;
pub use space::path_in_space;
pub use style::{Dash, STYLE, Style};
