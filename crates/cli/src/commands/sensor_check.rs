//! `gripgen sensor check`: what changed since a sensor file was made.

use crate::args::SensorCheckArgs;
use crate::commands::compare::{page_scores, shown};
use crate::failure::Failure;
use crate::load::{drop_doubtful_rest, no_presses, note_jpegs, say_circles};
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::{PressGeometry, find_circles_with_sensor, load_presses, load_sensor};
use gripgen::Location;
use gripgen::tactile::Sensor;
use gripgen::tactile::metrics::MetricError;
use gripgen::tactile::presses::{
    BeyondBall, Cause, Change, CompareError, DayCheck, DayError, DayNumber, GreyRms, PressComparison,
    PressScore, PressSet, RestDoubt, Spot, check_day, score_press,
};
use gripgen_report::{PressMap, PressPage, press_page};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Runs the verb.
pub fn run(args: &SensorCheckArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads(&args.presses).reads(&args.sensor);
    outputs.allow_all(args.out.as_deref().into_iter().chain(args.report.as_deref()))?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let (sensor, mut set) = load(args)?;
    let had_rest = set.rest.is_some();
    let jpeg_images = note_jpegs(&args.presses, &args.talk);
    let rest = drop_doubtful_rest(&args.presses, &mut set, &args.talk);
    let circles = find_circles_with_sensor(&mut set, &sensor);
    say_circles(&circles, &args.talk);
    let found = check_day(&set, &sensor).map_err(|e| refused(args, &e))?;
    let doubts = Doubts { jpeg_images, had_rest, rest, without_contact: circles.without_contact };
    if !args.talk.quiet {
        warnings(&found).iter().for_each(|warning| eprintln!("warning: {warning}"));
    }
    set.presses.retain(|press| found.names.contains(&press.name));
    if let Some(path) = &args.report {
        let page = page(args, &set, &found).map_err(Failure::new)?;
        let page = press_page(&page, |i| found.drawn.get(i).cloned());
        outputs.write(path, page.as_bytes())?;
    }
    let written = match (&args.out, &found.today) {
        (Some(path), Some(today)) => {
            outputs.write(path, &npz(today)?)?;
            Some(path)
        }
        _ => None,
    };
    let document = || document(args, &found, &doubts, written.is_some());
    if args.out.is_some() && written.is_none() {
        if !args.talk.quiet && !sink.on_stdout() {
            print(&in_words(&found))?;
        }
        sink.finish(true, document, String::new)?;
        return Err(Failure::new(
            "none of the changes that were tried explains these presses, so there is no file for this day",
        )
        .hint("calibrate again: `gripgen calibrate presses` with 30 presses"));
    }
    sink.finish(args.talk.quiet, document, || {
        let path = written.map_or_else(String::new, |path| format!("{}\n", path.display()));
        in_words(&found) + &path
    })
}

/// The sensor file and presses of its size.
fn load(args: &SensorCheckArgs) -> Result<(Sensor, PressSet), Failure> {
    let sensor = load_sensor(&Location::parse(&args.sensor))
        .map_err(|e| Failure::usage(e).hint("`gripgen calibrate presses` writes a sensor file"))?;
    let ball_m = args.ball_mm.map(|mm| mm * 1e-3).or(sensor.ball_m);
    let geometry = PressGeometry { ball_m, metres_per_px: Some(sensor.grid.metres_per_px) };
    let set = load_presses(&args.presses, geometry)
        .map_err(|e| no_presses(&e, "--ball-mm: measure the ball with calipers"))?;
    Ok(((*sensor).clone(), set))
}

fn refused(args: &SensorCheckArgs, e: &DayError) -> Failure {
    let failure = Failure::usage(format!("{}: {e}", args.presses.display()));
    match e {
        DayError::TooFew { .. } => {
            failure.hint("five presses of the ball of the calibration, all over the gel")
        }
        DayError::Size { .. } => failure.hint("name the sensor file that belongs to these presses"),
        _ => failure
            .hint("pixels count from 0 at the top left; leave the cells empty to have a contact looked for"),
    }
}

fn npz(sensor: &Sensor) -> Result<Vec<u8>, Failure> {
    let bytes = match sensor.to_npz() {
        Some(bytes) => bytes.map_err(Failure::new)?,
        None => return Err(Failure::new("the colours of this sensor have no place in a sensor file")),
    };
    // What cannot be read again is no sensor file.
    Sensor::from_npz(&bytes, None, None)
        .map_err(|e| Failure::new(format!("the sensor of that day cannot be: {e}")))?;
    Ok(bytes)
}

/// What may be wrong with the presses themselves.
struct Doubts {
    jpeg_images: Vec<String>,
    had_rest: bool,
    rest: Option<RestDoubt>,
    without_contact: Vec<String>,
}

/// What else the presses show.
fn warnings(found: &DayCheck) -> Vec<String> {
    let mut list = Vec::new();
    if let Some(beyond) = &found.beyond_ball {
        list.push(beyond_in_words(beyond, found.names.len()));
    }
    if !found.spots.is_empty() {
        let places: Vec<String> = found.spots.iter().map(spot_in_words).collect();
        list.push(format!(
            "a scratch or dirt: the same is left in several presses at {}; --report draws a map",
            places.join(", ")
        ));
    }
    list
}

fn beyond_in_words(beyond: &BeyondBall, presses: usize) -> String {
    format!(
        "{} of {presses} marks are wider than the ball; the smallest ball that fits is {:.2} mm: measure ball and pixel again",
        beyond.presses,
        1e3 * beyond.smallest_ball_m
    )
}

fn spot_in_words(spot: &Spot) -> String {
    let Spot { x_px, y_px, pixels, presses, .. } = spot;
    format!("({x_px:.0}, {y_px:.0}) px ({pixels} px, {presses} presses)")
}

/// What a cause means, and what to do.
fn meaning(cause: Option<Cause>) -> &'static str {
    match cause {
        Some(Cause::Nothing) => "the sensor file holds",
        Some(Cause::Light) => "the light or the camera's gains changed",
        Some(Cause::Gel) => "the gel gives way in another way around contacts",
        Some(Cause::Scale) => "the camera has another scale: a pixel shows another length",
        Some(Cause::Ball) => {
            "slopes in the contacts are those of a ball of another diameter; the sensor file stays"
        }
        Some(Cause::Force) => "contacts have another size than marks or depths say; the sensor file stays",
        None => "nothing that was tried explains these presses: calibrate again",
    }
}

/// What would tell two causes apart.
fn separate_by(a: Cause, b: Cause) -> &'static str {
    match (a, b) {
        (Cause::Ball, _) | (_, Cause::Ball) => "calipers on the ball, or presses of a ball of another size",
        (Cause::Force, _) | (_, Cause::Force) => "marks by hand, or presses with a measured depth (depth_mm)",
        (Cause::Scale, _) | (_, Cause::Scale) => "a known length on the gel",
        _ => "presses far from each other, and a frame without contact",
    }
}

/// The cause that the ties are ties with.
fn chosen(found: &DayCheck) -> Cause {
    found.change.cause()
}

fn in_words(found: &DayCheck) -> String {
    let mut text = format!("{}: {}\n", verdict(found), meaning(found.cause));
    for number in &found.numbers {
        let DayNumber { name, value, low90, high90 } = number;
        let _ = writeln!(text, "  {name:<24} {value:>8.3}  ({low90:.3} to {high90:.3})");
    }
    for tie in found.explanations.iter().filter(|e| e.ties) {
        let _ = writeln!(
            text,
            "not told apart from {}: {}",
            tie.cause.name(),
            separate_by(chosen(found), tie.cause)
        );
    }
    let (before, after) = (&found.cost.before, &found.cost.after);
    let _ = writeln!(text, "grey levels (rms)      contacts   frame");
    let _ = writeln!(text, "  this sensor file     {:>8.2} {:>7.2}", before.contact, before.frame);
    let _ = writeln!(
        text,
        "  file for this day    {:>8.2} {:>7.2}  on presses held out",
        after.contact, after.frame
    );
    text
}

fn verdict(found: &DayCheck) -> &'static str {
    found.cause.map_or("unknown", Cause::name)
}

fn rms(rms: &GreyRms) -> Value {
    json!({"contact": rms.contact, "frame": rms.frame})
}

fn number(number: &DayNumber) -> Value {
    json!({"value": number.value, "low90": number.low90, "high90": number.high90})
}

fn document(args: &SensorCheckArgs, found: &DayCheck, doubts: &Doubts, written: bool) -> Value {
    let explanations = found.explanations.iter().map(|e| {
        json!({"cause": e.cause.name(), "gain": e.gain, "gain_se": e.gain_se, "weight": e.weight, "ties": e.ties})
    });
    let ties = found
        .explanations
        .iter()
        .filter(|e| e.ties)
        .map(|e| json!({"cause": e.cause.name(), "separate_by": separate_by(chosen(found), e.cause)}));
    let numbers: Map<String, Value> = found.numbers.iter().map(|n| (n.name.to_string(), number(n))).collect();
    let light = match &found.change {
        Change::Light(light) => json!({"mixture": light.mixture, "field": light.field}),
        _ => Value::Null,
    };
    let spots = found.spots.iter().map(
        |s| json!({"x_px": s.x_px, "y_px": s.y_px, "pixels": s.pixels, "presses": s.presses, "grey": s.grey}),
    );
    json!({
        "schema": "gripgen.sensor_check/1",
        "sensor": args.sensor,
        "n": found.names.len(),
        "verdict": verdict(found),
        "best": chosen(found).name(),
        "indistinguishable_from": ties.collect::<Vec<_>>(),
        "explanations": explanations.collect::<Vec<_>>(),
        "numbers": numbers,
        "light": light,
        "radius": number(&found.radius),
        "grey_rms": {"before": rms(&found.cost.before), "after": rms(&found.cost.after)},
        "doubts": {
            "beyond_ball": found.beyond_ball.map(|b| json!({"presses": b.presses, "smallest_ball_mm": 1e3 * b.smallest_ball_m})),
            "spots": spots.collect::<Vec<_>>(),
            "rest": doubts.had_rest.then(|| json!({
                "used": doubts.rest.is_none(),
                "differs": doubts.rest.map(|doubt| doubt.differs),
                "presses_differ": doubts.rest.map(|doubt| doubt.presses_differ),
            })),
            "jpeg_images": doubts.jpeg_images,
            "without_contact": doubts.without_contact,
        },
        "today": args.out.as_ref().filter(|_| written),
        "report": args.report,
    })
}

fn page<'a>(
    args: &SensorCheckArgs,
    set: &'a PressSet,
    found: &DayCheck,
) -> Result<PressPage<'a>, CompareError> {
    let scored = set.presses.iter().zip(&found.drawn).map(|(press, drawn)| score_press(press, drawn));
    let each = scored.collect::<Result<Vec<PressScore>, MetricError>>()?;
    let comparison = PressComparison::from_each(each).ok_or(CompareError::Empty)?;
    let mut facts = vec![("verdict".to_string(), format!("{}: {}", verdict(found), meaning(found.cause)))];
    for n in &found.numbers {
        facts.push((n.name.into(), format!("{:.3} ({:.3} to {:.3})", n.value, n.low90, n.high90)));
    }
    for e in &found.explanations {
        let text = format!("gain {:.2} +- {:.2}, weight {:.2}", e.gain, e.gain_se, e.weight);
        facts.push((format!("as {}", e.cause.name()), text));
    }
    let grey = |rms: &GreyRms| {
        format!("{:.2} in contacts, {:.2} over the frame, grey levels (rms)", rms.contact, rms.frame)
    };
    facts.push(("this sensor file".into(), grey(&found.cost.before)));
    facts.push(("file for this day".into(), grey(&found.cost.after)));
    facts.extend(warnings(found).into_iter().map(|warning| ("doubt".to_string(), warning)));
    let map = PressMap {
        image: found.map.clone(),
        title: "Where something is left".into(),
        text: "Mean over the presses of real minus drawn, 8 times enlarged; grey is none. A scratch or dirt is sharp and stays in its \
               place; the rest moves with the contacts."
            .into(),
        caption: "mean of real minus drawn".into(),
    };
    Ok(PressPage {
        title: format!("{} on another day", args.sensor),
        summary: format!(
            "{} presses of {} against a sensor file.",
            set.presses.len(),
            args.presses.display()
        ),
        meaning: "Each press was drawn by a file for this day that was fitted without it.".into(),
        facts,
        map: Some(map),
        mean: page_scores(&comparison.mean),
        presses: shown(set, &comparison),
    })
}
