//! The margin: closed forms against the criterion at every frequency, bands of the thesis body, sentences.

use palpate_haptics::Period;
use palpate_haptics::margin::{
    LinearisedBody, LoopDevice, MarginCause, MarginSettings, SampledStep, active_cycles,
    active_pokes, criterion,
};
use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::{ModifiedKelvin, admissibility};
use palpate_model::{Depth, MmPerS, Newtons};
use palpate_rheology::integrators::{Scheme, SeriesBody};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;

/// The right side of the criterion as its paper writes it, in plain complex numbers.
fn as_written(sampled: &SampledStep, delay: f64, th: f64) -> f64 {
    type C = (f64, f64);
    let times = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let over = |a: C, b: C| {
        let size = b.0 * b.0 + b.1 * b.1;
        let (re, im) = times(a, (b.0, -b.1));
        (re / size, im / size)
    };
    let q = (th.cos(), -th.sin());
    let above = (sampled.now + sampled.before * q.0, sampled.before * q.1);
    let keep = 1.0 - sampled.share;
    let below = (1.0 - keep * q.0, -keep * q.1);
    let late = ((delay * th).cos(), -(delay * th).sin());
    let h = times(over(above, below), late);
    0.5 * sampled.tick / (1.0 - th.cos()) * times((1.0 - q.0, -q.1), h).0
}

/// A spring with a damper by differences needs `K T / 2 + B`, and a delay of `d` ticks `K (T/2 + d T)`.
#[test]
fn known_walls() {
    let spring = LinearisedBody { stiffness: 2.0, damping: 0.0, tau: 0.0 };
    let wall = SampledStep::of(&spring, Scheme::Exact, 1e-3);
    for (delay, expected) in [(0.0, 1e-3), (1.0, 3e-3), (2.5, 6e-3)] {
        let (needed, _) = criterion::damping_needed(&wall, delay);
        assert!((needed / expected - 1.0).abs() < 1e-9, "{delay}: {needed}");
    }
    // 2 N/mm and 3e-3 N s/mm at 1 ms: 4e-3.
    let damped = LinearisedBody { damping: 3e-3, ..spring };
    let wall = SampledStep::of(&damped, Scheme::Exact, 1e-3);
    let (needed, th) = criterion::damping_needed(&wall, 0.0);
    assert!((needed / 4e-3 - 1.0).abs() < 1e-12 && (th - std::f64::consts::PI).abs() < 1e-6);
}

/// Without delay the two ends are the whole criterion, for every scheme; and the numbers are those of the formula as it
/// stands in the paper.
#[test]
fn two_ends_are_the_whole_criterion_without_delay() {
    let mut random = SplitMix::seeded(7);
    for scheme in Scheme::ALL {
        for _ in 0..60 {
            let linear = LinearisedBody {
                stiffness: 10f64.powf(random.normal()),
                damping: 10f64.powf(random.normal() - 1.0),
                tau: 10f64.powf(1.5 * random.normal() - 1.0),
            };
            let tick = 10f64.powf(0.5 * random.normal() - 3.0);
            if scheme.stability_limit().is_some_and(|limit| tick / linear.tau >= limit) {
                continue;
            }
            let sampled = SampledStep::of(&linear, scheme, tick);
            let ends = sampled.slow().max(sampled.fast());
            let (needed, _) = criterion::damping_needed(&sampled, 0.0);
            let size = linear.stiffness * (tick + linear.tau) + linear.damping;
            assert!((needed - ends).abs() < 1e-8 * size, "{scheme:?} {linear:?}: {needed} {ends}");
            for th in [0.01, 0.3, 1.0, 2.0, 3.0] {
                for delay in [0.0, 1.0, 3.5] {
                    let ours = criterion::damping_needed_at(&sampled, delay, th);
                    let paper = as_written(&sampled, delay, th);
                    assert!((ours - paper).abs() < 1e-9 * size, "{scheme:?} {th}: {ours} {paper}");
                }
            }
        }
    }
}

/// The exact step needs `max(k0 T/2 + k0 tau - c0, k_inf T/2)` for ticks much shorter than `tau`; the left-edge exponential
/// half a tick of `k0` more, and less at the fast end.
#[test]
fn the_exact_and_the_left_edge_step_have_their_closed_forms() {
    for (k0, c0, tau, tick) in
        [(0.5, 0.02, 0.05, 1e-3), (1.0, 0.5, 0.05, 2e-3), (0.3, 3.0, 1.0, 5e-3)]
    {
        let linear = LinearisedBody { stiffness: k0, damping: c0, tau };
        let k_inf: f64 = c0 / tau;
        let exact = SampledStep::of(&linear, Scheme::Exact, tick);
        let slow = k0 * tick / 2.0 + k0 * tau - c0;
        assert!((exact.slow() - slow).abs() < 1e-12 * (slow.abs() + c0));
        // At the fast end k_inf T/2 is the limit of short ticks; the next term is (T/tau)^2 / 12 of k_inf and k0.
        let h = tick / tau;
        let miss = (exact.fast() - 0.5 * k_inf * tick).abs();
        assert!(miss < 0.5 * tick * (k_inf + k0) * h, "{miss:e}");
        let left = SampledStep::of(&linear, Scheme::ExponentialLeft, tick);
        let decay = (-h).exp();
        let expected = 1.5 * k0 * tick + k0 * tick * decay / (1.0 - decay) - c0;
        assert!((left.slow() - expected).abs() < 1e-12 * (expected.abs() + c0));
        let expected = 0.5 * tick * (1.0 - decay) / (1.0 + decay) * (2.0 * c0 / tick - k0);
        assert!((left.fast() - expected).abs() < 1e-12 * (expected.abs() + c0));
        // In slow motion it needs more: that is the mutant's price.
        assert!(left.slow() > exact.slow() + 0.49 * k0 * tick);
    }
}

/// Beside the criterion, what a tick can afford is at most a little too careful with a delay, never too bold.
#[test]
fn the_quick_margin_is_on_the_safe_side_of_the_criterion() {
    let mut random = SplitMix::seeded(11);
    let mut dearest = 1.0f64;
    for _ in 0..400 {
        let body = ModifiedKelvin {
            tau_eps: 10f64.powf(0.7 * random.normal() - 0.5),
            mu: [
                0.1 * random.normal().abs(),
                0.01 * random.normal().abs(),
                1e-3 * random.normal().abs(),
            ],
            tau_sig: 0.1 * random.normal().abs(),
        };
        let watch = MarginSettings {
            body: SeriesBody::from(body).padded(),
            scheme: Scheme::Exact,
            period: Period::of_nanos(250_000 * (1 + random.below(16) as u64)).expect("a period"),
            device: LoopDevice {
                damping: 0.002,
                friction: Newtons(0.0),
                count_mm: 0.015,
                delay_ticks: random.below(4) as f64,
            },
        };
        let depth = Depth(30.0 * (random.below(1000) as f64 + 1.0) / 1000.0);
        let quick = watch.at(depth, MmPerS(0.0));
        let whole = watch.exact_margin_at(depth, MmPerS(0.0));
        let size = quick.needed.abs().max(1e-6);
        assert!(whole.needed <= quick.needed + 1e-3 * size, "{watch:?} {quick:?} {whole:?}");
        if watch.device.delay_ticks == 0.0 {
            let (needed, _) = criterion::damping_needed(
                &SampledStep::of(
                    &LinearisedBody::of(&watch.body, depth),
                    watch.scheme,
                    watch.period.seconds().0,
                ),
                0.0,
            );
            assert!((needed - quick.needed).abs() < 1e-6 * size, "{watch:?}");
        } else if whole.needed > 0.0 {
            dearest = dearest.max(quick.needed / whole.needed);
        }
    }
    println!("the quick margin asks for at most {dearest:.3} of what the criterion does");
    // Sudden motion and lag are two ends of one curve: with delay the quick margin takes the worst of each.
    assert!(dearest < 4.0, "too careful to be of use: {dearest}");
}

/// Bands of the thesis body, from its parameters alone, and of any other as the admissibility of fits has them.
#[test]
fn bands_where_energy_comes_back() {
    let deepest = Depth(30.0);
    let body = SeriesBody::from(THESIS).padded();
    let [cycles] = active_cycles(&body, deepest)[..] else { panic!("one band") };
    let [pokes] = active_pokes(&body, deepest)[..] else { panic!("one band") };
    assert!((cycles.to.0 - 0.712).abs() < 5e-4 && cycles.from == Depth(0.0), "{cycles:?}");
    assert!((pokes.to.0 - 1.430).abs() < 5e-4 && pokes.from == Depth(0.0), "{pokes:?}");
    let mut random = SplitMix::seeded(13);
    let mut compared = 0;
    for _ in 0..300 {
        let body = ModifiedKelvin {
            tau_eps: random.normal().abs() + 0.01,
            mu: [0.1 * random.normal(), 0.01 * random.normal(), 1e-3 * random.normal()],
            tau_sig: 0.1 * random.normal(),
        };
        let padded = SeriesBody::from(body).padded();
        for (ours, known) in [
            (active_cycles(&padded, deepest), admissibility::active_cycles(&body)),
            (active_pokes(&padded, deepest), admissibility::active_pokes(&body)),
        ] {
            let known: Vec<_> = known
                .into_iter()
                .filter(|band| band.from < 30.0)
                .map(|band| (band.from, band.to.min(30.0)))
                .collect();
            // Bands too narrow for the grid aside.
            if known.iter().any(|(from, to)| to - from < 0.02) || known.len() != ours.len() {
                assert!(
                    known.windows(2).any(|pair| pair[1].0 - pair[0].1 < 0.02)
                        || known.iter().any(|(from, to)| to - from < 0.02),
                    "{body:?} {ours:?} {known:?}"
                );
                continue;
            }
            for (one, (from, to)) in ours.iter().zip(known) {
                assert!((one.from.0 - from).abs() < 1e-9 && (one.to.0 - to).abs() < 1e-9);
                compared += 1;
            }
        }
    }
    assert!(compared > 200, "{compared}");
}

#[test]
fn a_verdict_says_it_in_words() {
    let device = LoopDevice {
        damping: 0.0176,
        friction: Newtons(0.81),
        count_mm: 0.01534,
        delay_ticks: 0.0,
    };
    let watch = |device| MarginSettings {
        body: SeriesBody::from(THESIS).padded(),
        scheme: Scheme::Exact,
        period: Period::MILLISECOND,
        device,
    };
    // At the surface the lag alone asks for mu1 tau = 54.6 N s/m.
    let verdict = watch(device).assess_stroke(Depth(30.0), MmPerS(0.0));
    assert_eq!(verdict.worst.cause, MarginCause::Lag);
    assert!((verdict.worst.needed * 1e3 - 54.58).abs() < 0.05, "{:?}", verdict.worst);
    assert!(!verdict.is_calm() && (verdict.ratio().expect("a need") - 0.322).abs() < 1e-3);
    let sentences = verdict.sentences();
    println!("{sentences:#?}");
    assert!(sentences[0].contains("0.32"));
    for fact in ["below 0.", "0.810 N", "0.712 mm", "1.430 mm"] {
        assert!(sentences[1..].iter().any(|one| one.contains(fact)), "{fact}");
    }
    // Enough of everything.
    let calm = LoopDevice { damping: 0.06, ..device };
    // Moving in at 100 mm/s, half a tick of tau_sig v = 6 N/mm is 3 N s/m more; at 500 mm/s 15.
    assert!(watch(calm).assess_stroke(Depth(30.0), MmPerS(100.0)).is_calm());
    assert!(!watch(calm).assess_stroke(Depth(30.0), MmPerS(500.0)).is_calm());
    let verdict = watch(calm).assess_stroke(Depth(30.0), MmPerS(0.0));
    assert!(verdict.is_calm() && verdict.bands.is_empty(), "{:#?}", verdict.sentences());
    assert!(verdict.sentences()[0].contains("1.10"));
    // Without friction counts may swing.
    let smooth = LoopDevice { friction: Newtons(0.0), ..calm };
    let verdict = watch(smooth).assess_stroke(Depth(30.0), MmPerS(0.0));
    assert!(!verdict.is_calm() && verdict.sentences()[1].contains("encoder count"));
}
