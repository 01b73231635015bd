//! The printed tables.

use crate::Report;
use crate::ours::Scaling;
use crate::record::NOISE_N;
use crate::result::Fit;

/// Parameters of a peer and of palpate must agree this well, relative, or the peer is called wrong.
const AGREEMENT: f64 = 1e-6;

/// Prints everything; false if a peer is missing or wrong.
pub fn print(report: &Report) -> bool {
    let pinned = if report.is_pinned {
        "pinned to one core"
    } else {
        "NOT pinned: no taskset"
    };
    println!(
        "{} samples of the thesis protocol, seven free parameters, {pinned}",
        report.samples
    );
    if let Ok(peers) = &report.peers {
        let (python, numpy) = (&peers.python, &peers.numpy);
        let (scipy, lmfit) = (&peers.scipy, &peers.lmfit);
        println!(
            "Python {python}, numpy {numpy}, scipy {scipy}, lmfit {lmfit}; varpro crate 0.14.0"
        );
    }
    let mut is_good = true;
    for (which, title) in ["noiseless", "noisy"].into_iter().enumerate() {
        let noise = if which == 0 { 0.0 } else { NOISE_N };
        println!("\n{title}, {noise} N of noise");
        println!(
            "{:22}{:>12}{:>10}{:>16}",
            "",
            "seconds",
            "ratio",
            error_title(which)
        );
        let palpate = &report.palpate[which];
        line("palpate", palpate, palpate, which);
        match &report.varpro[which] {
            Ok(fit) => is_good &= line("varpro", fit, palpate, which),
            Err(text) => {
                println!("{:22}failed: {text}", "varpro");
                is_good = false;
            }
        }
        if let Ok(peers) = &report.peers {
            for peer in peers.fits.iter().filter(|peer| peer.record == title) {
                is_good &= line(&peer.name, &peer.fit, palpate, which);
            }
        }
    }
    if let Err(text) = &report.peers {
        println!("\nno Python peers: {text}");
        is_good = false;
    }
    is_good &= intervals(report);
    let live = &report.live;
    println!(
        "\nlive fit: {:.0} ns a sample, {:.1} us an estimate",
        live.push_s * 1e9,
        live.estimate_s * 1e6
    );
    println!(
        "  its last answer is off the exact fit by {:.1e} relative (noiseless), {:.1e} standard errors (noisy)",
        live.off_noiseless, live.off_noisy_sigmas
    );
    println!("\ncold fit against number of samples, noiseless");
    for (samples, seconds) in &report.scaling.points {
        println!(
            "{samples:>12}{seconds:>12.5} s{:>10.1} ns a sample",
            seconds * 1e9 / *samples as f64
        );
    }
    let Scaling {
        exponent,
        exponent_large,
        ..
    } = report.scaling;
    if exponent.is_finite() {
        println!("cost goes as samples^{exponent:.3}");
    }
    if exponent_large.is_finite() {
        println!("from 1e5 samples on as samples^{exponent_large:.3}");
    }
    is_good
}

fn error_title(which: usize) -> &'static str {
    ["worst error", "off palpate"][which]
}

/// One participant; false if it does not agree with palpate.
fn line(name: &str, fit: &Fit, palpate: &Fit, which: usize) -> bool {
    let shown = [fit.error(), fit.difference(palpate)][which];
    let difference = fit.difference(palpate);
    let is_wrong = difference > AGREEMENT || difference.is_nan();
    let remark = if is_wrong {
        "  WRONG: parameters differ by more than 1e-6"
    } else {
        ""
    };
    let ratio = fit.seconds / palpate.seconds;
    println!(
        "{name:22}{:>12.5}{ratio:>10.1}{shown:>16.1e}{remark}",
        fit.seconds
    );
    !is_wrong
}

/// Bounds must agree this well, in half-widths of lmfit's interval. palpate widens its own by what
/// memory it sees in the residuals, up to a percent or two by chance on white noise.
const BOUNDS_AGREEMENT: f64 = 0.03;

/// The profile intervals; false if they are missing or do not agree.
fn intervals(report: &Report) -> bool {
    println!(
        "\nfive profile intervals, 95 %, initial force and offset fixed at 0, noisy record, without the fit"
    );
    let (seconds, bounds) = match &report.profile {
        Ok(found) => found,
        Err(text) => {
            println!("{:22}failed: {text}", "palpate");
            return false;
        }
    };
    println!("{:22}{seconds:>12.5}{:>10.1}", "palpate", 1.0);
    let peers = report.peers.as_ref().ok();
    let Some(lmfit) = peers.and_then(|peers| peers.intervals.as_ref()) else {
        println!("{:22}not run", "lmfit conf_interval");
        return true;
    };
    let mut worst: f64 = 0.0;
    for (ours, theirs) in bounds.iter().zip(&lmfit.bounds) {
        let half = 0.5 * (theirs[1] - theirs[0]);
        for (a, b) in ours.iter().zip(theirs) {
            let off = (a - b).abs() / half;
            worst = if off.is_nan() { off } else { worst.max(off) };
        }
    }
    let is_wrong = worst > BOUNDS_AGREEMENT || worst.is_nan();
    let remark = if is_wrong { "  WRONG" } else { "" };
    println!(
        "{:22}{:>12.5}{:>10.1}  bounds differ by {worst:.1e} of a half-width{remark}",
        "lmfit conf_interval",
        lmfit.seconds,
        lmfit.seconds / seconds
    );
    !is_wrong
}
