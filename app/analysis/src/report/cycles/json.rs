//! The object that `palpate analyse --json` prints; `docs/json.md` has its fields.

use super::CycleReport;
use palpate_model::units::{Depth, Newtons};
use palpate_rheology::cycles::{
    Creep, CycleAnalysis, CyclePrediction, Estimate, PredictionError, Sinusoid, SinusoidError,
    StressRelaxation,
};
use serde_json::{Value, json};

/// The object for all records; `fitted` says where the predicted body is from.
#[must_use]
pub fn object(reports: &[CycleReport], fitted: Option<&str>) -> Value {
    let rule = reports.first().map(|report| report.rule).unwrap_or_default();
    json!({
        "command": "analyse",
        "steady_rule": { "percent": rule.percent, "in_a_row": rule.in_a_row },
        "fitted": fitted,
        "records": reports.iter().map(record).collect::<Vec<Value>>(),
    })
}

fn record(report: &CycleReport) -> Value {
    let cycles = (0..report.cycles.len()).map(|index| cycle(report, index));
    json!({
        "record": report.name,
        "samples": report.source.samples.len(),
        "cycles": cycles.collect::<Vec<Value>>(),
        "steady_from": report.steadiness.steady_from,
        "sines": report.sines.iter().map(sine).collect::<Vec<Value>>(),
        "notes": report.source.notes,
    })
}

fn pair<T: Copy>(estimate: Estimate<T>, number: impl Fn(T) -> f64) -> Value {
    json!([number(estimate.value), number(estimate.std_error)])
}

fn force(estimate: Estimate<Newtons>) -> Value {
    pair(estimate, Newtons::get)
}

fn depth(estimate: Estimate<Depth>) -> Value {
    pair(estimate, Depth::get)
}

fn number(estimate: Estimate<f64>) -> Value {
    pair(estimate, |number| number)
}

fn cycle(report: &CycleReport, index: usize) -> Value {
    let one: &CycleAnalysis = &report.cycles[index];
    let change = index.checked_sub(1).map(|before| report.steadiness.changes[before]);
    let first = report.cycles[0].depth_at_half_peak();
    let levels = one.levels.map(|level| {
        level.map(|level| json!({ "force_n": level.force.0, "depth_mm": depth(level.depth) }))
    });
    json!({
        "cycle": one.cycle,
        "start_s": one.start.0,
        "duration_s": one.duration.0,
        "speed_mm_per_s": one.speed.0,
        "depth_peak_mm": one.depth_peak.0,
        "force_start_n": one.force_start.map(force),
        "force_peak_n": force(one.force_peak),
        "peak_change_percent": change.map(|change| change.peak_percent),
        "levels": levels,
        "shift_mm": change.and_then(|change| change.shift).map(Depth::get),
        "shift_from_first_mm": first.zip(one.depth_at_half_peak()).map(|(from, to)| to.0 - from.0),
        "work_loading_n_mm": one.work_loading,
        "work_loop_n_mm": one.work_loop,
        "loss_share": one.loss_share(),
        "stiffness": one.stiffness.map(|stiffness| json!({
            "depth_mm": stiffness.depth.0,
            "n_per_mm": number(stiffness.slope),
        })),
        "relaxation": one.relaxation.as_ref().map(relaxation),
        "creep": one.creep.iter().map(creep).collect::<Vec<Value>>(),
        "prediction": report.predictions.get(index).map(prediction),
    })
}

fn relaxation(one: &StressRelaxation) -> Value {
    json!({
        "duration_s": one.duration.0,
        "force_end_n": force(one.force_end),
        "percent": number(one.percent),
        "half_time_s": one.half_time.map(|time| time.0),
        "rate_end_n_per_s": number(one.rate_end),
        "equilibrium_n": one.equilibrium.map(force),
    })
}

fn creep(one: &Creep) -> Value {
    json!({
        "duration_s": one.duration.0,
        "force_n": one.force.0,
        "force_sd_n": one.force_sd.0,
        "depth_start_mm": one.depth_start.0,
        "depth_end_mm": depth(one.depth_end),
        "percent": one.percent,
        "rate_end_mm_per_s": number(one.rate_end),
    })
}

fn prediction(result: &Result<CyclePrediction, PredictionError>) -> Value {
    let one = match result {
        Ok(one) => one,
        Err(err) => return json!({ "error": err.to_string() }),
    };
    json!({
        "peak_n": one.peak.0,
        "rms_n": one.rms.0,
        "rms_percent": one.percent(one.rms),
        "mean_n": one.mean.0,
        "sd_n": one.sd.0,
        "sd_percent": one.percent(one.sd),
        "worst_n": one.worst.0.0,
        "worst_percent": one.percent(one.worst.0),
        "worst_at_s": one.worst.1.0,
        "at_peak_n": force(one.at_peak),
        "at_peak_percent": one.percent(one.at_peak.value),
        "at_end_n": one.at_end.map(force),
        "at_end_percent": one.at_end.map(|end| one.percent(end.value)),
    })
}

fn sine(result: &Result<Sinusoid, SinusoidError>) -> Value {
    let one = match result {
        Ok(one) => one,
        Err(err) => return json!({ "error": err.to_string() }),
    };
    json!({
        "frequency_hz": one.frequency,
        "cycles": one.cycles,
        "depth_mean_mm": one.depth_mean.0,
        "depth_amplitude_mm": one.depth_amplitude.0,
        "force_mean_n": one.force_mean.0,
        "force_amplitude_n": force(one.force_amplitude),
        "phase_degrees": number(one.phase_degrees),
        "storage_n_per_mm": number(one.storage),
        "loss_n_per_mm": number(one.loss),
        "distortion_percent": one.distortion_percent,
        "zero_share": one.zero_share,
        "remark": one.remark(),
    })
}
