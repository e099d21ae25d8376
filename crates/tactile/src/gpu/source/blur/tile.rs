//! What the tiled blurs read and write. A thread asks for many values before it uses the first: a graphics processor answers after
//! half a microsecond, and most of a blur would be waiting.

use super::{Axis, Blur, Restored, TILE_THREADS};
use std::fmt::Write;

/// Threads along a row of the image.
const ABREAST: u32 = 32;

/// Values asked for at a time.
const AT_ONCE: usize = 16;

/// `ask` of some places and then `use_it` of each.
fn in_turns<T: Copy>(
    places: &[T],
    ask: impl Fn(usize, T) -> String,
    use_it: impl Fn(usize, T) -> String,
) -> String {
    let numbered: Vec<(usize, T)> = places.iter().copied().enumerate().collect();
    numbered.chunks(AT_ONCE).fold(String::new(), |mut text, turn| {
        for &(k, at) in turn {
            let _ = writeln!(text, "    {}", ask(k, at));
        }
        for &(k, at) in turn {
            let _ = writeln!(text, "    {}", use_it(k, at));
        }
        text
    })
}

/// First place and first line of what each thread of a blur along the rows takes: `columns` of them, of all lanes.
fn of_rows(columns: u32, lanes: u32) -> Vec<(u32, u32)> {
    let lines = (0..lanes).step_by((TILE_THREADS / ABREAST) as usize);
    lines.flat_map(|line| (0..columns).step_by(ABREAST as usize).map(move |at| (at, line))).collect()
}

/// Fills the tile.
pub(super) fn loads(blur: Blur, lanes: u32, run: u32) -> String {
    let length = TILE_THREADS / lanes * run + blur.kernel_px - 1;
    match blur.axis {
        Axis::X => in_turns(
            &of_rows(length, lanes),
            |k, (at, line)| {
                format!(
                    "let a{k} = source_at(first.x + i32(place + {at}u) - HALF, min(first.y + i32(line + {line}u), \
                     i32(frame.height_px) - 1), image);"
                )
            },
            |k, (at, line)| {
                let guard = format!("place + {at}u < LENGTH && line + {line}u < LANES");
                format!("if {guard} {{ tile[(place + {at}u) * PITCH + line + {line}u] = a{k}; }}")
            },
        ),
        Axis::Y => {
            let rows: Vec<u32> = (0..length).step_by((TILE_THREADS / lanes) as usize).collect();
            in_turns(
                &rows,
                |k, at| {
                    format!(
                        "let a{k} = source_at(min(x, i32(frame.width_px) - 1), first.y + i32(line + {at}u) - HALF, image);"
                    )
                },
                |k, at| format!("if line + {at}u < LENGTH {{ tile[(line + {at}u) * PITCH + lane] = a{k}; }}"),
            )
        }
    }
}

/// Puts the sums of a blur along the rows into the tile.
pub(super) fn exchange(run: u32) -> String {
    (0..run).fold(String::new(), |mut text, r| {
        let _ = writeln!(text, "    tile[base + {r}u * PITCH] = s{r};");
        text
    })
}

/// Writes what was blurred, with the depth of the contact where it is restored.
pub(super) fn finish(blur: Blur, lanes: u32, run: u32) -> String {
    let depth = |k: usize, x: &str, y: &str| {
        let load = |to: &str, plane: Option<&str>| match plane {
            Some(plane) => format!(
                "let {to}{k} = load_{plane}(min(u32({x}), frame.width_px - 1u), min(u32({y}), frame.height_px - 1u), image);"
            ),
            None => format!("let {to}{k} = 0.0;"),
        };
        let (depth, share) = match blur.restore {
            Some(Restored::Whole) => (Some("contact"), None),
            Some(Restored::Share(_)) => (Some("core"), Some("share")),
            None => (None, None),
        };
        load("d", depth) + " " + &load("s_", share)
    };
    match blur.axis {
        Axis::X => in_turns(
            &of_rows(TILE_THREADS / lanes * run, lanes),
            |k, (at, line)| {
                depth(k, &format!("first.x + i32(place + {at}u)"), &format!("first.y + i32(line + {line}u)"))
            },
            |k, (at, line)| {
                format!(
                    "if line + {line}u < LANES {{ finish(first.x + i32(place + {at}u), first.y + i32(line + {line}u), \
                     image, tile[(place + {at}u) * PITCH + line + {line}u], d{k}, s_{k}); }}"
                )
            },
        ),
        Axis::Y => {
            let rows: Vec<u32> = (0..run).collect();
            in_turns(
                &rows,
                |k, r| depth(k, "x", &format!("y + {r}")),
                |k, r| format!("finish(x, y + {r}, image, s{r}, d{k}, s_{k});"),
            )
        }
    }
}
