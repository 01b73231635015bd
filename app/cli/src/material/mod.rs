//! `palpate material`: the moduli of a press by a contact law.

pub(super) mod failure;

use super::arguments::{Choice, choice, parse_columns, parse_number, positive};
use super::fit::{jobs, lake, saved};
use super::output::Output;
use super::recalibrate::{self, AuthorArgs};
use super::{Failure, compliance};
use clap::Args;
use palpate_analysis::dynamic::{DynamicRequest, MasterCurveRequest, master_curve};
use palpate_analysis::material::{ErrorSource, MaterialRequest};
use palpate_analysis::material_lake::{LakeMaterialRequest, material_lake};
use palpate_analysis::property::{Property, PropertyRequest, find_property};
use palpate_analysis::report::master_curve::master_curve_text;
use palpate_analysis::report::property::property_text;
use palpate_analysis::session_actions::MaterialToStore;
use palpate_analysis::shared_library::store_address;
use palpate_indentation::{
    Base, ContactLaw, Indenter, PoissonBasis, PyramidFaces, Quantity, RelaxationFamily,
};
use palpate_tables::lake::{LakeResult, Shard, is_lake};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Moduli of a press by a contact law, with the probe's shape and the thickness taken out
#[derive(Debug, Args)]
pub struct MaterialArgs {
    /// Session folder, or a delimited table with columns for time, depth and force; or a lake, which keeps the moduli of
    /// loadings; or the sessions of a master curve
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// What is found of the material
    #[arg(long, value_parser = choice(PROPERTIES), default_value = "modulus")]
    property: PropertyWord,
    /// Shape of the indenter
    #[arg(long, value_parser = choice(INDENTERS))]
    indenter: IndenterWord,
    /// Radius of a sphere or a flat punch in mm with its standard uncertainty, as in 3.00±0.02 or 3.00+-0.02
    #[arg(long, value_name = "MM", value_parser = quantity, allow_hyphen_values = true)]
    radius: Option<Quantity>,
    /// Angle between axis and flank of a cone, or axis and face of a pyramid, in degrees
    #[arg(long, value_name = "DEGREES", value_parser = quantity, allow_hyphen_values = true)]
    half_angle: Option<Quantity>,
    /// Radius of the round tip of a cone or a pyramid in mm; without it the tip is sharp
    #[arg(long, value_name = "MM", value_parser = quantity, allow_hyphen_values = true)]
    tip_radius: Option<Quantity>,
    /// Width of the chamfer of 45 degrees of a flat punch in mm; without it the edge is sharp
    #[arg(long, value_name = "MM", value_parser = quantity, allow_hyphen_values = true)]
    chamfer: Option<Quantity>,
    /// Thickness of the specimen in mm; without it the one that the session measured
    #[arg(long, value_name = "MM", value_parser = quantity, allow_hyphen_values = true)]
    thickness: Option<Quantity>,
    /// Poisson's ratio of the specimen, 0 to 0.5
    #[arg(long, value_name = "RATIO", value_parser = quantity, allow_hyphen_values = true)]
    poisson: Quantity,
    /// Poisson's ratio was measured on this tissue; without it, it is stated as assumed
    #[arg(long)]
    poisson_measured: bool,
    /// How the specimen lies on its base
    #[arg(long, value_parser = choice(BASES), default_value = "bonded")]
    base: Base,
    /// Law of the contact; without it that of a layer
    #[arg(long, value_parser = choice(LAWS))]
    law: Option<ContactLaw>,
    /// Take the loading up to this depth in mm; without it all of it
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    depth_max: Option<f64>,
    /// Standard uncertainty in mm of the contact at depth zero, 0 for exact, or free to find it from the loading alone;
    /// without it that of the session, and free for a table
    #[arg(long, value_name = "MM|free", value_parser = error_source, allow_hyphen_values = true)]
    contact_error: Option<ErrorSource>,
    /// Standard uncertainty in N of the force out of contact, 0 for exactly zero, or free to find it from the approach;
    /// without it how far the session's signal out of contact wandered, and free for a table
    #[arg(long, value_name = "N|free", value_parser = error_source, allow_hyphen_values = true)]
    zero_error: Option<ErrorSource>,
    /// Names of the columns of tables that have no header, as in t_s,x_mm,F_N
    #[arg(long, value_name = "NAMES")]
    columns: Option<String>,
    /// Apply this analysis of the session: its calibration and its excluded stretches
    #[arg(long, value_name = "NAME")]
    analysis: Option<String>,
    /// Take a rejected session too
    #[arg(long)]
    include_rejected: bool,
    /// Correct depths for machine compliance: last for the compliance in force for the session's rig, a file, or an id of
    /// the library
    #[arg(long, value_name = "FILE|last")]
    compliance: Option<String>,
    /// Model family of the relaxation modulus; without it prony
    #[arg(long, value_parser = choice(FAMILIES))]
    family: Option<FamilyWord>,
    /// Terms of the Prony series; without it as many as the record is worth
    #[arg(long, value_name = "COUNT")]
    terms: Option<usize>,
    /// Treat a table as one sine of this frequency in Hz; a session has its own
    #[arg(long, value_name = "HZ", value_parser = positive)]
    frequency: Option<f64>,
    /// Mass in g that moves between load cell and specimen, as probe and rod; without it none
    #[arg(long, value_name = "GRAMS", value_parser = quantity, allow_hyphen_values = true)]
    moving_mass: Option<Quantity>,
    /// Temperature in degrees Celsius at which a master curve is; without it the middle one of its sessions
    #[arg(long, value_name = "CELSIUS", allow_negative_numbers = true)]
    reference_temperature: Option<f64>,
    /// Save the property as an analysis of this name with its session
    #[arg(long, value_name = "NAME")]
    save: Option<String>,
    #[command(flatten)]
    author: AuthorArgs,
    /// Fit only the i-th of n parts of a lake, as in 2/8; which part a session is in depends on its name alone
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Also add the moduli of a lake to the tables of this store, as in s3://bucket/folder or file:///folder; a modulus that is there
    /// is passed over
    #[arg(long, value_name = "STORE", value_parser = store_address)]
    store: Option<String>,
    /// Number of sessions of a lake fitted at a time; without it the number of processors
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PropertyWord {
    Modulus,
    Unloading,
    Relaxation,
    Dynamic,
    MasterCurve,
}

const PROPERTIES: &[Choice<PropertyWord>] = &[
    ("modulus", PropertyWord::Modulus, "Young's modulus of the loading"),
    ("unloading", PropertyWord::Unloading, "Young's modulus of the unloading, by Oliver and Pharr"),
    ("relaxation", PropertyWord::Relaxation, "the relaxation modulus of ramp and hold"),
    ("dynamic", PropertyWord::Dynamic, "storage and loss modulus of sines"),
    (
        "master-curve",
        PropertyWord::MasterCurve,
        "those of sessions at several temperatures, as one curve",
    ),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FamilyWord {
    Prony,
    Fractional,
}

const FAMILIES: &[Choice<FamilyWord>] = &[
    ("prony", FamilyWord::Prony, "a sum of exponentials"),
    ("fractional", FamilyWord::Fractional, "the fractional Zener model"),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum IndenterWord {
    FlatPunch,
    Sphere,
    Cone,
    Pyramid(PyramidFaces),
}

const INDENTERS: &[Choice<IndenterWord>] = &[
    ("flat-punch", IndenterWord::FlatPunch, "the flat end of a cylinder"),
    ("sphere", IndenterWord::Sphere, "a sphere"),
    ("cone", IndenterWord::Cone, "a cone"),
    ("pyramid-3", IndenterWord::Pyramid(PyramidFaces::Three), "three faces, as Berkovich's"),
    ("pyramid-4", IndenterWord::Pyramid(PyramidFaces::Four), "four faces, as Vickers'"),
];

const BASES: &[Choice<Base>] =
    &[("bonded", Base::Bonded, "it sticks"), ("frictionless", Base::Frictionless, "it slips")];

const LAWS: &[Choice<ContactLaw>] = &[
    ("hertz", ContactLaw::Hertz, "a shallow sphere on a thick specimen"),
    ("sneddon", ContactLaw::Sneddon, "any shape on a thick specimen"),
    ("layer", ContactLaw::Layer, "any shape on a specimen on a rigid base"),
];

pub(super) fn run(args: &MaterialArgs, output: &Output) -> Result<(), Failure> {
    check_flags(args)?;
    // The command line has one source at least.
    let source = &args.sources[0];
    if args.sources.len() > 1 && args.property != PropertyWord::MasterCurve {
        return Err(Failure::usage(
            "only a master curve takes several sources; give one, or --property master-curve",
        ));
    }
    let press = request(args, source)?;
    if is_lake(source) {
        return over_lake(args, &press, output);
    }
    lake::check_given(&[("--shard", args.shard.is_some()), ("--store", args.store.is_some())])?;
    let property = match args.property {
        PropertyWord::Modulus => Property::Modulus,
        PropertyWord::Unloading => Property::Unloading,
        PropertyWord::Relaxation => Property::Relaxation { family: family(args)? },
        PropertyWord::Dynamic => {
            Property::Dynamic { frequency_hz: args.frequency, moving_mass_g: args.moving_mass }
        }
        PropertyWord::MasterCurve => return sweeps_at_temperatures(args, output),
    };
    saved::check(args.save.as_ref(), source)?;
    let request = PropertyRequest { press, property };
    let report = find_property(&request).map_err(failure::of_property)?;
    if let Some(name) = &args.save {
        let stored = MaterialToStore::of(&request, &report).store(name, &args.author.author());
        stored.map_err(recalibrate::analysis_edit_failure)?;
    }
    report.notes().iter().for_each(|note| output.note(note));
    output.answer("material", &report, || {
        let saved = args.save.iter().map(|name| format!("saved as analysis '{name}'"));
        [property_text(&report)].into_iter().chain(saved).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}

/// The sweeps of sessions at several temperatures as one curve.
fn sweeps_at_temperatures(args: &MaterialArgs, output: &Output) -> Result<(), Failure> {
    let presses: Result<Vec<_>, Failure> =
        args.sources.iter().map(|source| request(args, source)).collect();
    let presses = presses?;
    let sweep = |press| DynamicRequest {
        press,
        frequency_hz: args.frequency,
        moving_mass_g: args.moving_mass,
    };
    let request = MasterCurveRequest {
        sweeps: presses.iter().map(sweep).collect(),
        reference_temperature_c: args.reference_temperature,
    };
    let report = master_curve(&request).map_err(failure::of_master_curve)?;
    report.notes.iter().for_each(|note| output.note(note));
    output.answer("material", &report, || master_curve_text(&report));
    Ok(())
}

fn family(args: &MaterialArgs) -> Result<Option<RelaxationFamily>, Failure> {
    match (args.family, args.terms) {
        (Some(FamilyWord::Fractional), None) => Ok(Some(RelaxationFamily::Fractional)),
        (Some(FamilyWord::Fractional), Some(_)) => {
            Err(Failure::usage("--terms belongs to --family prony; leave it out"))
        }
        (_, terms) => Ok(terms.map(|terms| RelaxationFamily::Prony { terms })),
    }
}

/// Fits the sessions of a lake, or of one shard, and stores the moduli in the lake.
fn over_lake(args: &MaterialArgs, press: &MaterialRequest, output: &Output) -> Result<(), Failure> {
    lake::refuse_options(&[
        ("--property", args.property != PropertyWord::Modulus),
        ("--columns", args.columns.is_some()),
        ("--save", args.save.is_some()),
        ("--analysis", args.analysis.is_some()),
    ])?;
    let request = LakeMaterialRequest {
        press,
        shard: args.shard.unwrap_or(Shard::WHOLE),
        compliance_sha256: args.compliance.as_deref().map(lake::hash_file).transpose()?,
        jobs: jobs(args.jobs),
    };
    let place = lake::ResultPlace {
        lake: &press.source,
        result: LakeResult::Modulus,
        store: args.store.as_deref(),
    };
    lake::fit_each("material", &place, output, |is_ending, hear| {
        material_lake(&request, is_ending, hear)
    })
}

/// A flag that belongs to another property.
fn check_flags(args: &MaterialArgs) -> Result<(), Failure> {
    use PropertyWord::{Dynamic, MasterCurve, Modulus, Relaxation, Unloading};
    let given: [(&str, bool, &[PropertyWord], &str); 10] = [
        ("depth-max", args.depth_max.is_some(), &[Modulus], "the modulus of a loading"),
        ("zero-error", args.zero_error.is_some(), &[Modulus, Unloading], "a Young's modulus"),
        (
            "law",
            args.law.is_some(),
            &[Modulus, Relaxation, Dynamic, MasterCurve],
            "what is no unloading",
        ),
        ("family", args.family.is_some(), &[Relaxation], "a relaxation modulus"),
        ("terms", args.terms.is_some(), &[Relaxation], "a relaxation modulus"),
        ("frequency", args.frequency.is_some(), &[Dynamic], "dynamic moduli"),
        ("moving-mass", args.moving_mass.is_some(), &[Dynamic, MasterCurve], "dynamic moduli"),
        (
            "reference-temperature",
            args.reference_temperature.is_some(),
            &[MasterCurve],
            "a master curve",
        ),
        ("save", args.save.is_some() && args.property == MasterCurve, &[], "one session"),
        ("analysis", args.analysis.is_some() && args.property == MasterCurve, &[], "one session"),
    ];
    let is_wrong = |own: &[PropertyWord]| !own.contains(&args.property);
    let wrong = given.into_iter().find(|(_, is_given, own, _)| *is_given && is_wrong(own));
    wrong.map_or(Ok(()), |(flag, .., of)| {
        Err(Failure::usage(format!("--{flag} belongs to {of}; leave it out")))
    })
}

fn request(args: &MaterialArgs, source: &Path) -> Result<MaterialRequest, Failure> {
    Ok(MaterialRequest {
        source: source.to_owned(),
        columns: parse_columns(args.columns.as_deref())?,
        analysis: args.analysis.clone(),
        is_rejected_included: args.include_rejected,
        corrections: compliance::corrections(args.compliance.as_deref())?,
        law: args.law.unwrap_or(ContactLaw::Layer),
        indenter: indenter(args)?,
        thickness_mm: args.thickness,
        base: args.base,
        poisson_ratio: args.poisson,
        poisson_basis: match args.poisson_measured {
            true => PoissonBasis::Measured,
            false => PoissonBasis::Assumed,
        },
        depth_max_mm: args.depth_max,
        contact: args.contact_error.unwrap_or(ErrorSource::Recorded),
        force_zero: args.zero_error.unwrap_or(ErrorSource::Recorded),
    })
}

fn indenter(args: &MaterialArgs) -> Result<Indenter, Failure> {
    let given = [
        ("radius", args.radius),
        ("half-angle", args.half_angle),
        ("tip-radius", args.tip_radius),
        ("chamfer", args.chamfer),
    ];
    let only = |names: &[&str]| {
        let unused = given.iter().find(|(name, size)| size.is_some() && !names.contains(name));
        unused.map_or(Ok(()), |(name, _)| {
            Err(Failure::usage(format!("this indenter has no --{name}; leave it out")))
        })
    };
    let needed = |name: &str| {
        let size = given.iter().find(|(own, _)| *own == name).and_then(|(_, size)| *size);
        size.ok_or_else(|| {
            Failure::usage(format!(
                "this indenter needs --{name}; give it, with its standard uncertainty"
            ))
        })
    };
    let pointed = ["half-angle", "tip-radius"];
    Ok(match args.indenter {
        IndenterWord::FlatPunch => {
            only(&["radius", "chamfer"])?;
            let radius_mm = needed("radius")?;
            match args.chamfer {
                Some(chamfer_mm) => Indenter::ChamferedPunch { radius_mm, chamfer_mm },
                None => Indenter::FlatPunch { radius_mm },
            }
        }
        IndenterWord::Sphere => {
            only(&["radius"])?;
            Indenter::Sphere { radius_mm: needed("radius")? }
        }
        IndenterWord::Cone => {
            only(&pointed)?;
            let half_angle_degrees = needed("half-angle")?;
            match args.tip_radius {
                Some(tip_radius_mm) => Indenter::RoundedCone { half_angle_degrees, tip_radius_mm },
                None => Indenter::Cone { half_angle_degrees },
            }
        }
        IndenterWord::Pyramid(faces) => {
            only(&pointed)?;
            let half_angle_degrees = needed("half-angle")?;
            match args.tip_radius {
                Some(tip_radius_mm) => {
                    Indenter::RoundedPyramid { faces, half_angle_degrees, tip_radius_mm }
                }
                None => Indenter::Pyramid { faces, half_angle_degrees },
            }
        }
    })
}

/// `3.00±0.02`, or a number that is taken as exact.
fn quantity(text: &str) -> Result<Quantity, String> {
    let (value, error) =
        text.split_once('±').or_else(|| text.split_once("+-")).unwrap_or((text, "0"));
    let number = |part: &str| parse_number(part.trim());
    Ok(Quantity { value: number(value)?, standard_uncertainty: number(error)? })
}

fn error_source(text: &str) -> Result<ErrorSource, String> {
    match text.trim() {
        "free" => Ok(ErrorSource::Free),
        text => parse_number(text).map(ErrorSource::Stated),
    }
}
