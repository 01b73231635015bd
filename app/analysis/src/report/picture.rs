//! A fit as one picture: measured and fitted force over time, what is left over beneath, the
//! parameters and every sentence. A refused fit shows the path of the probe and the reason.

use super::fit_json::FitOverlay;
use super::text::{ParameterText, energy, equation, limit, quality};
use palpate_figures::drawing::{Anchor, AxisColours, Drawing, FONT, Svg, TextStyle as TextInk};
use palpate_figures::figure::{
    self, AxisNames, Ink, Plot, PlotAxis, PlotBand, PlotLevel, PlotSeries,
};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;
use palpate_rheology::fit::{FitReport, FitSample};

/// Width of a picture in px.
const WIDTH: f64 = 960.0;
/// Left and right edge of what is drawn.
pub(super) const LEFT: f64 = 76.0;
pub(super) const RIGHT: f64 = 936.0;
/// Pixels between both: each has two points of a line at most.
pub(super) const COLUMNS: usize = (RIGHT - LEFT) as usize;
/// Height of a line of text.
pub(super) const LINE: f64 = 20.0;
/// Letters that fit into a line of sentences: sans-serif letters are about half as wide as high.
const LETTERS: usize = 120;

/// The band of a calibration around a force reaches so many standard uncertainties either way: about 95 % where errors
/// are normal (JCGM 100:2008, 6.2).
const SIGMAS: f64 = 2.0;

const BAND_NAME: &str = "calibration, ± 2u";

/// The band around points whose ordinates are forces in N; `None` where no uncertainty is stated.
pub(super) fn band(
    forces: &[[f64; 2]],
    uncertainty: Option<&ForceUncertainty>,
) -> Option<PlotBand> {
    let edge = |sigmas: f64| {
        let at = |&[x, force]: &[f64; 2]| {
            let sigma = uncertainty?.sigma(Newtons(force))?;
            Some([x, force + sigmas * sigma.0])
        };
        forces.iter().filter_map(at).collect::<Vec<_>>()
    };
    let edges = [edge(-SIGMAS), edge(SIGMAS)];
    let is_stated = !edges[0].is_empty();
    is_stated.then(|| PlotBand { name: BAND_NAME.to_owned(), ink: Ink::Series, edges })
}

/// The picture of a fit that was made: force over time, what is left over, force over depth, parameters and sentences.
/// `source` is what was fitted, for the title; around the force lies the band of twice its calibration's standard
/// uncertainty, where that is stated.
#[must_use]
pub fn of_report(
    source: &str,
    (samples, overlay): (&[FitSample], &FitOverlay),
    report: &FitReport,
    uncertainty: Option<&ForceUncertainty>,
) -> String {
    let mut svg = curves(source, (samples, &overlay.forces), report, uncertainty);
    // Where the force is not known the fit is not drawn over depth: the probe may have left the tissue.
    let pairs = samples.iter().zip(&overlay.forces);
    let known = || pairs.clone().filter(|(one, _)| one.is_measured());
    let measured = thin(known().map(|(one, _)| [one.depth.0, one.force.0]), COLUMNS);
    let fitted = thin(known().map(|(one, fit)| [one.depth.0, fit.0]), COLUMNS);
    let deepest = known().fold(0.0f64, |deepest, (one, _)| deepest.max(one.depth.0));
    let depth = PlotAxis::linear("depth (mm)").with_range([0.0, deepest]);
    let over_depth = force_plot(depth, [measured, fitted], uncertainty);
    over_depth.draw(&mut svg, [LEFT, 576.0, RIGHT, 790.0], AxisNames::Both);
    let mut y = 860.0;
    for text in equation(report).map(str::to_owned).into_iter().chain([energy(overlay)]) {
        svg.text([LEFT, y], TextInk::plain(LIGHT.text), &text);
        y += LINE;
    }
    y = table(&mut svg, report, y + LINE);
    for sentence in report.sentences().map(str::to_owned).chain(limit(report)) {
        y = sentence_lines(&mut svg, y, TextInk::plain(LIGHT.text), &sentence);
    }
    svg.finish(y, LIGHT.canvas, &format!("Fit of {source}"))
}

/// The picture without depth, parameters and sentences, for pages that have them as text.
#[must_use]
pub fn of_fit(
    source: &str,
    samples: &[FitSample],
    report: &FitReport,
    uncertainty: Option<&ForceUncertainty>,
) -> Drawing {
    let svg = curves(source, (samples, &report.predict(samples)), report, uncertainty);
    svg.drawing(556.0, LIGHT.canvas, &format!("Fit of {source}"))
}

/// Measured and fitted force over time, and what is left over beneath.
fn curves(
    source: &str,
    (samples, modelled): (&[FitSample], &[Newtons]),
    report: &FitReport,
    uncertainty: Option<&ForceUncertainty>,
) -> Svg {
    let mut svg = titled(source, &format!("{}; {}", report.model, quality(report)));
    let start = samples.first().map_or(0.0, |sample| sample.t.0);
    let [mut force, mut residual] =
        plots_over_time((samples, modelled), uncertainty, -start, COLUMNS);
    force.x.range = Some(span(samples));
    residual.x.range = Some(span(samples));
    figure::legend(&mut svg, [RIGHT, 46.0], &force);
    force.draw(&mut svg, [LEFT, 66.0, RIGHT, 360.0], AxisNames::Upright);
    residual.draw(&mut svg, [LEFT, 396.0, RIGHT, 510.0], AxisNames::Both);
    svg
}

/// Force over time, measured and fitted, and what is left over, thinned to so many columns. A shift in s is added to
/// all times.
#[must_use]
pub fn fit_plots(
    samples: &[FitSample],
    report: &FitReport,
    uncertainty: Option<&ForceUncertainty>,
    shift: f64,
    columns: usize,
) -> [Plot; 2] {
    plots_over_time((samples, &report.predict(samples)), uncertainty, shift, columns)
}

fn plots_over_time(
    (samples, modelled): (&[FitSample], &[Newtons]),
    uncertainty: Option<&ForceUncertainty>,
    shift: f64,
    columns: usize,
) -> [Plot; 2] {
    let pairs = || samples.iter().zip(modelled);
    // A force that is not known leaves nothing over.
    let known = || pairs().filter(|(one, _)| one.is_measured());
    let measured = thin(known().map(|(one, _)| [one.t.0 + shift, one.force.0]), columns);
    let fitted = thin(pairs().map(|(one, fit)| [one.t.0 + shift, fit.0]), columns);
    let residuals = known().map(|(one, fit)| [one.t.0 + shift, (one.force.0 - fit.0) * 1e3]);
    let residual = PlotSeries::line("residual", Ink::Series, 1.0, thin(residuals, columns));
    let time = || PlotAxis::linear("time (s)");
    [
        force_plot(time(), [measured, fitted], uncertainty),
        Plot {
            levels: vec![PlotLevel::plain(0.0, Ink::Quiet)],
            ..Plot::new("", time(), PlotAxis::linear("residual (mN)")).with([residual])
        },
    ]
}

/// Measured and fitted force over something, the band of the force's calibration around the fitted.
pub(super) fn force_plot(
    x: PlotAxis,
    [measured, fitted]: [Vec<[f64; 2]>; 2],
    uncertainty: Option<&ForceUncertainty>,
) -> Plot {
    Plot {
        bands: band(&fitted, uncertainty).into_iter().collect(),
        ..Plot::new("", x, PlotAxis::linear("force (N)")).with([
            // Wide under narrow, so that both are seen where they agree.
            PlotSeries::line("measured", Ink::Series, 2.6, measured),
            PlotSeries::line("fitted", Ink::Limit, 1.4, fitted),
        ])
    }
}

/// The picture of a fit that was refused, with the sentence that says why.
#[must_use]
pub fn of_refusal(source: &str, samples: &[FitSample], sentence: &str) -> String {
    let start = samples.first().map_or(0.0, |sample| sample.t.0);
    let depth = thin(samples.iter().map(|one| [one.t.0 - start, one.depth.0]), COLUMNS);
    let mut svg = titled(source, "not fitted");
    let plot = Plot::new(
        "",
        PlotAxis::linear("time (s)").with_range(span(samples)),
        PlotAxis::linear("depth (mm)"),
    );
    plot.with([PlotSeries::line("", Ink::Series, 1.6, depth)]).draw(
        &mut svg,
        [LEFT, 66.0, RIGHT, 360.0],
        AxisNames::Both,
    );
    let y = sentence_lines(&mut svg, 434.0, TextInk::plain(LIGHT.alarm_text), sentence);
    svg.finish(y, LIGHT.canvas, &format!("Refused fit of {source}"))
}

/// From the first sample to the last, in s. A refused record may have times out of order.
fn span(samples: &[FitSample]) -> [f64; 2] {
    let start = samples.first().map_or(0.0, |sample| sample.t.0);
    let passed = samples.iter().map(|sample| sample.t.0 - start);
    let last = passed.filter(|t| t.is_finite()).fold(0.0, f64::max);
    [0.0, if last > 0.0 { last } else { 1.0 }]
}

pub(super) fn look() -> AxisColours {
    AxisColours { text: LIGHT.text_quiet, grid: LIGHT.line }
}

/// An empty picture with a title and a line beneath it.
pub(super) fn titled(title: &str, line: &str) -> Svg {
    let mut svg = Svg::new(WIDTH);
    let ink = TextInk { size: 18.0, ..TextInk::plain(LIGHT.text) };
    svg.text([LEFT, 28.0], ink, title);
    svg.text([LEFT, 50.0], TextInk::plain(LIGHT.text_quiet), line);
    svg
}

/// The parameters from `y` on; returns where what follows may begin.
fn table(svg: &mut Svg, report: &FitReport, mut y: f64) -> f64 {
    let places = [LEFT, 180.0, 420.0, 540.0];
    let quiet = TextInk::plain(LIGHT.text_quiet);
    let heads = ["parameter", "value ± standard error", "unit", "95 % interval"];
    for (x, head) in places.into_iter().zip(heads) {
        svg.text([x, y], quiet, head);
    }
    svg.line(&[[LEFT, y + 6.0], [RIGHT, y + 6.0]], LIGHT.line, 1.0);
    for parameter in &report.parameters {
        y += LINE;
        let text = ParameterText::of(parameter);
        let intervals = text.intervals();
        let cells = [text.name, text.value, text.unit, intervals];
        for (x, cell) in places.into_iter().zip(&cells) {
            svg.text([x, y + 4.0], TextInk::plain(LIGHT.text), cell);
        }
    }
    y + 2.0 * LINE
}

/// A sentence from `y` on, wrapped; returns where the next one may begin.
pub(super) fn sentence_lines(svg: &mut Svg, mut y: f64, ink: TextInk, sentence: &str) -> f64 {
    for line in wrap(sentence, LETTERS) {
        svg.text([LEFT, y], ink.anchored(Anchor::Start), &line);
        y += FONT + 5.0;
    }
    y + 8.0
}

/// Words in lines of at most `letters`; a longer word stands alone.
pub(super) fn wrap(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
    use palpate_model::{Depth, Seconds};
    use palpate_rheology::fit::{FitOptions, fit};

    fn record(force_of: impl Fn(usize, f64) -> f64) -> Vec<FitSample> {
        let mut state = KelvinState::at_rest();
        (0..3000usize)
            .map(|i| {
                let t = i as f64 * 0.03;
                let depth = Depth((0.75 * t).min(30.0));
                let dt = Seconds(if i == 0 { 0.0 } else { 0.03 });
                let force = state.step(&ModifiedKelvin::THESIS, depth, dt).0;
                FitSample {
                    t: Seconds(t),
                    depth,
                    force: Newtons(force_of(i, force)),
                    sigma: Newtons(0.02),
                }
            })
            .collect()
    }

    #[test]
    fn a_picture_shows_curves_parameters_and_sentences() {
        // A slow wave on the force, so that there is something left over and a sentence on it.
        let samples = record(|i, force| force + 0.05 * (i as f64 * 0.01).sin());
        let report = fit(&samples, &FitOptions::default()).unwrap();
        assert!(report.sentences().count() > 0);
        let overlay = FitOverlay::of(&report, &samples);
        let picture = of_report("S & T <1>", (&samples, &overlay), &report, None);
        assert!(picture.contains("S &amp; T &lt;1&gt;"));
        for parameter in &report.parameters {
            let text = ParameterText::of(parameter);
            for part in [text.name, text.value, text.unit, text.interval] {
                assert!(picture.contains(&part), "{part}");
            }
        }
        for sentence in report.sentences() {
            assert!(picture.contains(&wrap(sentence, LETTERS)[0]), "{sentence}");
        }
        assert!(!picture.contains("<polygon"));
        let thesis = ForceUncertainty::of(&palpate_model::calibration::Calibration::thesis());
        let banded = of_report("S", (&samples, &overlay), &report, thesis.as_ref().ok());
        // Around the force over time and over depth.
        assert_eq!(banded.matches("<polygon").count(), 2);
        // Five curves of at most two points a pixel, and nothing that is not a number.
        let mut words = picture.split(|one: char| !one.is_ascii_alphabetic());
        assert!(!words.any(|word| ["NaN", "inf"].contains(&word)));
        assert!(picture.len() < 5 * 2 * 860 * 14 + 20_000, "{}", picture.len());
        let sizes = picture.split("font-size=\"").skip(1);
        for size in sizes.filter_map(|rest| rest.split('"').next()) {
            assert!(size.parse::<f64>().unwrap() >= 12.0, "{size}");
        }
    }

    #[test]
    fn a_refusal_shows_the_path_and_the_sentence() {
        let mut samples = record(|_, force| force);
        samples.truncate(1300);
        samples[7].force = Newtons(f64::NAN);
        let refusal = fit(&samples, &FitOptions::default()).unwrap_err().to_string();
        let picture = of_refusal("ramp", &samples, &refusal);
        assert!(picture.contains(&wrap(&refusal, LETTERS)[0]), "{refusal}");
        assert!(picture.contains("depth (mm)") && !picture.contains("NaN\""));
        assert!(of_refusal("nothing", &[], "no samples").contains("no samples"));
    }

    #[test]
    fn lines_break_between_words() {
        assert_eq!(wrap("one two three", 7), ["one two", "three"]);
        assert_eq!(wrap("unbreakable", 4), ["unbreakable"]);
        assert!(wrap("", 4).is_empty());
    }
}
