use super::*;
use crate::svg::class;
use crate::{Plot, Series};
use gripgen_identify::{DataSummary, ErrorReport, ErrorsBy, Rival, SeparateBy};
use std::collections::{BTreeMap, BTreeSet};

fn held_out(rmse: f64) -> HeldOutError {
    let (low90, high90, mape_pct) = (0.9 * rmse, 1.1 * rmse, Some(6.0 * rmse));
    HeldOutError { rmse_n: Some(rmse), mse: None, rmse_mm3: None, low90, high90, mape_pct }
}

fn estimate(value: f64, unit: &str) -> ParameterEstimate {
    ParameterEstimate::new(value, (0.9 * value, 1.1 * value), unit)
}

/// A number that looks random.
fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898).sin() * 43_758.545_3;
    2.0 * (x - x.floor()) - 1.0
}

fn diagnosis() -> Diagnosis {
    let data = DataSummary {
        pulls: Some(440),
        traces: Some(88),
        sha256: "0123456789abcdef0123456789abcdef".into(),
        outliers: vec!["p0031".into()],
        ..Default::default()
    };
    let seen = Detectable { parameter: "beta".into(), value: 0.02, power: 0.8 };
    let pair = |before, after| ErrorPair { before: held_out(before), after: held_out(after) };
    Diagnosis {
        noise_floor_n: Some(0.31),
        verdict: Verdict::Effect,
        effects: vec![NamedEffect {
            named_again: None,
            name: "wear".into(),
            part: None,
            class: vec!["wear".into(), "sensor_gain_drift".into()],
            weight: 0.52,
            parameters: BTreeMap::from([
                ("depth".into(), estimate(0.22, "1")),
                ("n0".into(), estimate(310.0, "1")),
            ]),
            indistinguishable_from: vec![Rival { name: "sensor_gain_drift".into(), weight: 0.41 }],
            separate_by: Some(SeparateBy {
                text: "pause 30 min, then repeat the first grip 5 times".into(),
                campaign: Some("next.toml".into()),
            }),
        }],
        unknown: vec![UnknownCovariate { covariate: "humidity_pct".into(), strength: 0.41, p_value: 0.001 }],
        would_have_seen: BTreeMap::from([("dwell_ageing".into(), seen)]),
        not_excited: vec!["grip_angle_deg".into()],
        not_recorded: vec!["temperature_c".into()],
        baseline: BTreeMap::from([
            ("parts.gear.mu".into(), estimate(0.183, "1")),
            ("robot.lag_s".into(), estimate(0.052, "s")),
        ]),
        error: Some(ErrorReport {
            heldout: "repetitions".into(),
            before: held_out(1.9),
            after: held_out(0.33),
            by: ErrorsBy { levels: Some(pair(2.1, 0.36)), sessions: Some(pair(2.4, 0.41)) },
        }),
        plain: Some(
            "The friction falls with the number of pulls (wear, or a drift of the sensor's gain); adding it lowers the held-out \
             error from 1.90 N to 0.33 N."
                .into(),
        ),
        notes: vec!["3 pulls were left out: they failed".into()],
        ..Diagnosis::blank(Channel::Pulls, data)
    }
}

fn residuals(title: &str, label: &str, n: usize, words: &[&str], width: f64) -> Plot {
    let x = |i: usize| {
        if words.is_empty() { width * (0.5 + 0.5 * noise(7 * i)) } else { (i % words.len()) as f64 }
    };
    let before = Series::points("before", (0..n).map(|i| (x(i), 2.0 * noise(i) - x(i) / width)));
    let after = Series::points("after", (0..n).map(|i| (x(i), 0.4 * noise(i + 9))));
    let x_words = words.iter().map(|w| w.to_string()).collect();
    Plot { x_words, ..Plot::new(title, label, "measured - predicted, N", vec![before, after]) }
}

/// An answer with its report.
struct Diagnosed {
    diagnosis: Diagnosis,
    report: ReportData,
}

impl Diagnosed {
    fn page(&self) -> String {
        diagnosis_page(&self.diagnosis, &self.report)
    }
}

/// A report such as a diagnosis of `n` pulls makes.
fn diagnosed(n: usize) -> Diagnosed {
    let levels = [5.0, 8.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0];
    let force = |mu: f64| levels.iter().map(move |f| (*f, 2.0 * mu * f));
    let part = |name: &str, mu: f64| Series {
        errors: levels.iter().map(|f| 0.02 * f + 0.3).collect(),
        ..Series::points(name, force(mu))
    };
    let limits = vec![part("gear", 0.19), part("long_shaft", 0.16), Series::line("gear, twin", force(0.188))];
    let pull = |f: f64| {
        let steps = || (0..400).map(|i| 0.01 * f64::from(i)).map(|t| (t, t * 9.6 * f));
        let real = (0..).zip(steps()).map(|(i, p)| (p.0, p.1.min(11.0 * f) + 0.2 * noise(i)));
        let series = vec![
            Series::line("measured", real),
            Series::line("simulated", steps().map(|p| (p.0, p.1.min(11.2 * f)))),
            Series::line("command", steps()),
        ];
        Plot::new(format!("pull p00{f:02}: gear, {:.0} N", 40.0 * f), "time, s", "force, N", series)
    };
    let long = ["2025-03-01 morning", "2025-03-01 afternoon", "2025-03-02 morning", "x", "y", "z"];
    let groups = vec![
        PlotGroup {
            title: "Residual against each covariate".into(),
            about: "Measured minus predicted, before and after the effects were added.".into(),
            plots: vec![
                residuals("grip force", "grip force per jaw, N", n, &[], 80.0),
                residuals("pull index", "pulls since the gel was new", n, &[], 440.0),
                residuals("session", "session", n, &["1", "2", "3"], 3.0),
                residuals("time", "time since the start, s", n, &[], 41_000.0),
                residuals("operator", "operator", n, &long, 6.0),
                residuals("temperature", "temperature, C", n, &[], 0.02),
            ],
        },
        PlotGroup {
            title: "Maximum pull force over grip force".into(),
            about: "Means of the repetitions with their standard deviations; the line is the new twin."
                .into(),
            plots: vec![Plot::new("all parts", "grip force per jaw, N", "maximum pull force, N", limits)],
        },
        PlotGroup {
            title: "Pull curves".into(),
            about: "Simulation over measurement.".into(),
            plots: [0.5, 1.0, 2.0].map(pull).into(),
        },
    ];
    let candidates = [
        ("wear", "named"),
        ("sensor_gain_drift", "tied with wear"),
        ("none", "worse"),
        ("curve in humidity_pct", "worse"),
    ];
    let evidence = |(i, (name, fate)): (usize, (&str, &str))| EvidenceRow {
        name: name.into(),
        heldout_gain: 210.0 - 70.0 * i as f64,
        standard_error: 6.1,
        heldout_error: 0.33 + 0.5 * i as f64,
        values: "depth 0.22, n0 310".into(),
        fate: fate.into(),
    };
    let worst = |i: u32| WorstRow {
        id: format!("p00{}", 31 + i),
        about: "gear, 40 N".into(),
        measured: 12.1,
        predicted: 14.0,
        deviations: -6.2 + f64::from(i),
    };
    let report = ReportData {
        title: "Diagnosis of lab-x".into(),
        groups,
        decides: 0,
        next: vec![(
            "Make the pulls that tell apart what these could not:".into(),
            "gripgen rig pull rig.toml --campaign next.toml".into(),
        )],
        evidence: candidates.into_iter().enumerate().map(evidence).collect(),
        worst: (0..6).map(worst).collect(),
        error_unit: "N".into(),
    };
    Diagnosed { diagnosis: diagnosis(), report }
}

/// Reads a page with an XML parser and returns the names of its elements and its text.
fn parse(page: &str) -> (BTreeSet<String>, String) {
    let (mut elements, mut text) = (BTreeSet::new(), String::new());
    for event in xml::EventReader::from_str(page) {
        match event.unwrap_or_else(|e| panic!("not well-formed: {e}")) {
            xml::reader::XmlEvent::StartElement { name, attributes, .. } => {
                for a in &attributes {
                    assert!(!a.name.local_name.starts_with("on"), "{} of {}", a.name, name.local_name);
                }
                elements.insert(name.local_name);
            }
            xml::reader::XmlEvent::Characters(s) => text.push_str(&s),
            _ => {}
        }
    }
    (elements, text)
}

#[test]
fn a_line_has_the_colour_of_its_points() {
    let points = |name: &str| Series::points(name, [(0.0, 0.0)]);
    let line = |name: &str| Series::line(name, [(0.0, 0.0), (1.0, 1.0)]);
    let colours = |all: &[Series]| (0..all.len()).map(|i| class(all, i)).collect::<Vec<_>>();
    let lines = [
        points("gear"),
        line("gear 0, expected"),
        line("gear 1, expected"),
        points("shaft"),
        line("shaft, expected"),
    ];
    assert_eq!(colours(&lines), ["c0", "c0", "c0", "c1", "c1"]);
    assert_eq!(colours(&[points("gear"), points("shaft")]), ["c0", "c1"], "the same without lines");
    assert_eq!(colours(&[points("gear"), line("gearbox")]), ["c0", "c1"], "another name");
}

#[test]
fn the_page_is_well_formed_and_needs_nothing_from_elsewhere() {
    let page = diagnosed(440).page();
    let (elements, text) = parse(&page);
    for forbidden in ["script", "link", "img", "iframe", "object"] {
        assert!(!elements.contains(forbidden), "{forbidden}");
    }
    assert!(!page.contains("http") && !page.contains("url(") && !page.contains("@import"));
    assert!(page.len() < 500_000, "{} bytes", page.len());
    for said in [
        "Diagnosis of lab-x",
        "wear, or a drift",
        "held-out repetitions, after: 0.330 (0.297 to 0.363)",
        "noise floor 0.310",
        "depth = 0.220",
        "(0.198 to 0.242)",
        "sensor_gain_drift",
        "pause 30 min",
        "next.toml",
        "humidity_pct",
        "grip force per jaw, N",
        "2025-03-01 aftern\u{2026}",
        "dwell_ageing",
        "grip_angle_deg",
        "temperature_c",
        "p0031",
        "parts.gear.mu",
        "3 pulls were left out",
        "11.4 % before, 1.98 % after",
    ] {
        assert!(text.contains(said), "the page does not say `{said}`");
    }
    assert_eq!(page.matches("<svg").count(), 1 + 6 + 1 + 3);
    if let Ok(folder) = std::env::var("GRIPGEN_REPORT_FOLDER") {
        std::fs::write(format!("{folder}/report.html"), &page).unwrap();
    }
}

#[test]
fn its_size_does_not_follow_that_of_the_data() {
    let mut large = diagnosed(100_000);
    let plots = large.report.groups[0].plots.clone();
    large.report.groups[0].plots = plots.iter().cycle().take(90).cloned().collect();
    large.report.worst = large.report.worst.iter().cycle().take(100_000).cloned().collect();
    large.report.evidence = large.report.evidence.iter().cycle().take(500).cloned().collect();
    large.diagnosis.notes = vec!["long ".repeat(100_000); 100];
    large.diagnosis.data.outliers = vec!["p".repeat(1000); 100_000];
    large.diagnosis.plain = Some("x".repeat(1_000_000));
    large.report.groups[1].plots[0].x_words = vec!["a word".repeat(50); 10_000];
    let page = large.page();
    assert!(page.len() < 500_000, "{} bytes", page.len());
    let (_, text) = parse(&page);
    assert!(text.contains("34 more plots are not shown"), "90 + 1 + 3 of 60");
    assert_eq!(page, large.page(), "the same points every time");
}

/// Whatever stands in the data is shown as text.
#[test]
fn words_of_the_data_are_never_markup() {
    let evil = "<script>alert('1')</script>&\"' \u{1} </svg> {{ x }} {% y %} \u{ffff}";
    let mut d = diagnosed(10);
    let s = || evil.to_string();
    let report = &mut d.report;
    (report.title, report.error_unit) = (s(), s());
    report.worst[0].id = s();
    report.evidence[0].name = s();
    report.evidence[0].values = s();
    report.groups[0].title = s();
    let plot = &mut report.groups[0].plots[2];
    (plot.title, plot.x_label, plot.y_label) = (s(), s(), s());
    plot.x_words = vec![s(), s(), s()];
    plot.series[0].name = s();
    let diagnosis = &mut d.diagnosis;
    diagnosis.effects[0].name = s();
    diagnosis.effects[0].separate_by = Some(SeparateBy { text: s(), campaign: Some(s()) });
    diagnosis.unknown[0].covariate = s();
    diagnosis.not_recorded = vec![s()];
    diagnosis.data.outliers = vec![s()];
    diagnosis.baseline.insert(s(), estimate(1.0, evil));
    diagnosis.would_have_seen.insert(s(), Detectable { parameter: s(), value: 1.0, power: 0.8 });
    let page = d.page();
    let (elements, text) = parse(&page);
    assert!(!elements.contains("script") && !page.contains("<script"));
    assert!(text.contains("<script>alert('1')</script>"), "it is shown as it is");
}

/// Numbers that are none leave the page whole.
#[test]
fn odd_numbers_and_empty_reports_make_a_page() {
    let mut d = diagnosed(20);
    let odd = [f64::NAN, f64::INFINITY, -f64::INFINITY, f64::MAX, f64::MIN, 0.0, 1e-308];
    let odd_points: Vec<(f64, f64)> = odd.iter().flat_map(|&x| odd.map(|y| (x, y))).collect();
    for plot in d.report.groups.iter_mut().flat_map(|g| &mut g.plots) {
        plot.series[0].errors = vec![f64::NAN; odd_points.len()];
        plot.series[0].points = odd_points.clone();
    }
    d.report.evidence[0].heldout_gain = f64::NAN;
    d.diagnosis.effects[0].weight = f64::NAN;
    d.diagnosis.noise_floor_n = Some(f64::NAN);
    d.diagnosis.error.as_mut().unwrap().before.rmse_n = Some(f64::INFINITY);
    let page = d.page();
    parse(&page);
    assert!(!page.contains("NaN") && !page.contains("inf"), "a number that is none is a dash");

    let mut empty = diagnosed(0);
    empty.report = ReportData { title: "Diagnosis".into(), ..Default::default() };
    empty.diagnosis = Diagnosis {
        verdict: Verdict::Insufficient,
        effects: vec![],
        unknown: vec![],
        error: None,
        notes: vec![],
        ..empty.diagnosis
    };
    let (_, text) = parse(&empty.page());
    assert!(text.contains("the data cannot answer"));
}

#[test]
fn the_verdict_names_what_was_found() {
    let named = |change: &dyn Fn(&mut Diagnosis)| {
        let mut d = diagnosis();
        change(&mut d);
        names(&d)
    };
    let one = "wear (not told apart from sensor_gain_drift)";
    let unknown = "something that goes with humidity_pct";
    assert_eq!(named(&|_| {}), format!(": {one}; {unknown}"));
    assert_eq!(named(&|d| d.effects.clear()), format!(": {unknown}"));
    let second = |d: &mut Diagnosis| {
        d.unknown.clear();
        let (name, part) = ("jaw_tilt".into(), Some("gear".into()));
        d.effects.push(NamedEffect {
            name,
            part,
            weight: 0.05,
            indistinguishable_from: vec![],
            ..d.effects[0].clone()
        });
    };
    assert_eq!(named(&second), format!(": {one}; perhaps jaw_tilt on gear"));
    assert_eq!(named(&|d| *d = Diagnosis::blank(Channel::Pulls, DataSummary::default())), "");
}

/// A limit of nearly a million newtons is no size at which anything would have been seen.
#[test]
fn a_size_at_the_neutral_value_is_not_shown() {
    let mut d = diagnosed(10);
    for (value, shown) in [(999_999.0, false), (60.0, true)] {
        let seen = Detectable { parameter: "limit_n".into(), value, power: 0.8 };
        d.diagnosis.would_have_seen.insert("sensor_saturation".into(), seen);
        assert_eq!(parse(&d.page()).1.contains("limit_n"), shown, "{value}");
    }
}

#[test]
fn a_long_command_can_be_copied_from_the_page() {
    let mut d = diagnosed(10);
    let command = format!("gripgen diagnose {} -o diagnosed.toml", "folder/".repeat(300));
    d.report.next = vec![("Write the corrected twin:".into(), command.clone())];
    assert!(parse(&d.page()).1.contains(&command));
}
