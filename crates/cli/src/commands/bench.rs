//! `gripgen bench`: images per second on this machine.

use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::load::jobs;
use crate::output::JsonSink;
use crate::outputs::Outputs;
use crate::{BenchOptions, BenchReport, bench};
use gripgen::twin::config::Backend;
use serde_json::{Value, json};

/// Runs the verb.
pub fn run(args: &BenchArgs) -> Result<u8, Failure> {
    let backend = args.backend.into();
    if args.adapter.is_some() && backend == Backend::Cpu {
        return Err(Failure::usage("--adapter goes with --backend gpu"));
    }
    let mut outputs = Outputs::new(args.json.force).reads_all(&args.sensor);
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let options = BenchOptions {
        backend,
        sensor: args.sensor.clone(),
        adapter: args.adapter.clone(),
        seconds: args.seconds,
        threads: jobs(),
    };
    let report = bench(&options)?;
    sink.finish(false, || as_json(&report), || in_words(&report))
}

fn name(backend: Backend) -> &'static str {
    match backend {
        Backend::Cpu => "cpu",
        Backend::Gpu => "gpu",
    }
}

fn as_json(report: &BenchReport) -> Value {
    let rates: Vec<Value> = report
        .rates
        .iter()
        .map(|r| {
            json!({
                "what": r.what, "images_per_s": r.images_per_s(), "images": r.images, "seconds": r.seconds,
                "threads": r.threads,
            })
        })
        .collect();
    json!({
        "schema": "gripgen.bench/1",
        "backend": name(report.backend),
        "adapter": report.adapter.as_ref().map(|a| json!({
            "name": a.name, "api": a.api, "driver": a.driver, "software": a.software,
        })),
        "batch": report.batch,
        "simd": format!("{:?}", report.level).to_lowercase(),
        "colour": report.colour,
        "width_px": report.size_px.0,
        "height_px": report.size_px.1,
        "triangles": report.triangles,
        "rates": rates,
        "stages": report.stages.iter().map(|(stage, s)| json!({"stage": stage, "seconds_per_batch": s}))
            .collect::<Vec<_>>(),
    })
}

fn in_words(report: &BenchReport) -> String {
    let mut text = match (&report.adapter, report.batch) {
        (Some(adapter), Some(batch)) => format!("{adapter}, batches of {batch}\n"),
        _ => format!("processor, {:?}\n", report.level),
    };
    let (width, height) = report.size_px;
    text += &format!(
        "{width} x {height} pixels, colours {}, from a mesh of {} triangles, pose to image with noise\n",
        report.colour, report.triangles
    );
    for rate in &report.rates {
        let what = match rate.what {
            "one_core" => "one thread".into(),
            "all_cores" => format!("{} threads", rate.threads),
            "device_resident" => "left on the device".into(),
            _ => "read back".to_string(),
        };
        text += &format!(
            "{what:<20}{:>10.0} images/s   ({} in {:.2} s)\n",
            rate.images_per_s(),
            rate.images,
            rate.seconds
        );
    }
    if let Some(batch) = report.batch {
        let whole: f64 = report.stages.iter().map(|(_, s)| s).sum();
        for (stage, seconds) in &report.stages {
            text += &format!(
                "  {stage:<18}{:>10.2} us an image   ({:.0} % of the stages)\n",
                seconds / batch as f64 * 1e6,
                100.0 * seconds / whole
            );
        }
    }
    if report.adapter.as_ref().is_some_and(|a| a.software) {
        text += "This adapter computes on the processor: its rate says nothing about a graphics processor.\n";
    }
    text
}
