//! The page of `--live`; the command line serves it.

use crate::report::rendered_with;
use serde_json::json;

/// The page as HTML. It asks the address that it came from for `/state` (`gripgen.live/1`), `/left.png` and `/right.png`, and
/// nothing else.
pub fn live_page() -> String {
    rendered_with("live.html", &json!({}))
}
