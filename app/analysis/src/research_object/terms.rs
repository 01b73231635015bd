//! Identifiers of species, organs and units, so that a program that has never heard of palpate finds a crate of pig liver.
//!
//! Species are those of the NCBI Taxonomy, organs and tissues those of UBERON, units those of the Units of Measurement
//! Ontology and of QUDT. A word that is not here stays a word.

/// A term of a published vocabulary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Term {
    /// Such as `NCBITaxon:9823`.
    pub code: &'static str,
    pub name: &'static str,
    /// Words that mean it.
    words: &'static [&'static str],
}

impl Term {
    /// Its address, by the rule of the OBO Foundry.
    #[must_use]
    pub fn address(&self) -> String {
        format!("http://purl.obolibrary.org/obo/{}", self.code.replace(':', "_"))
    }
}

const fn term(code: &'static str, name: &'static str, words: &'static [&'static str]) -> Term {
    Term { code, name, words }
}

const SPECIES: &[Term] = &[
    term("NCBITaxon:9823", "Sus scrofa", &["pig", "porcine", "swine", "sus scrofa"]),
    term("NCBITaxon:9913", "Bos taurus", &["cow", "cattle", "calf", "bovine", "bos taurus"]),
    term("NCBITaxon:9606", "Homo sapiens", &["human", "homo sapiens"]),
    term("NCBITaxon:10090", "Mus musculus", &["mouse", "mice", "murine", "mus musculus"]),
    term("NCBITaxon:10116", "Rattus norvegicus", &["rat", "rats", "rattus norvegicus"]),
    term("NCBITaxon:9940", "Ovis aries", &["sheep", "lamb", "ovine", "ovis aries"]),
    term("NCBITaxon:9986", "Oryctolagus cuniculus", &["rabbit", "oryctolagus cuniculus"]),
    term("NCBITaxon:9031", "Gallus gallus", &["chicken", "gallus gallus"]),
];

const ORGANS: &[Term] = &[
    term("UBERON:0002107", "liver", &["liver", "hepatic"]),
    term("UBERON:0002113", "kidney", &["kidney", "renal"]),
    term("UBERON:0000955", "brain", &["brain"]),
    term("UBERON:0001134", "skeletal muscle tissue", &["muscle", "skeletal muscle"]),
    term("UBERON:0000948", "heart", &["heart", "myocardium", "cardiac"]),
    term("UBERON:0002097", "skin of body", &["skin"]),
    term("UBERON:0002048", "lung", &["lung"]),
    term("UBERON:0001013", "adipose tissue", &["fat", "adipose"]),
    term("UBERON:0002106", "spleen", &["spleen"]),
    term("UBERON:0000945", "stomach", &["stomach", "gastric"]),
    term("UBERON:0001264", "pancreas", &["pancreas"]),
    term("UBERON:0000043", "tendon", &["tendon"]),
];

/// The species that some words name.
#[must_use]
pub fn species(text: &str) -> Option<&'static Term> {
    find(SPECIES, text)
}

/// The organ or tissue that some words name.
#[must_use]
pub fn organ(text: &str) -> Option<&'static Term> {
    find(ORGANS, text)
}

/// One term whose words are in the text; none where two are, because the text then says something of both.
fn find(terms: &'static [Term], text: &str) -> Option<&'static Term> {
    let letters = |letter: char| if letter.is_alphanumeric() { letter } else { ' ' };
    let text: String = text.to_lowercase().chars().map(letters).collect();
    let text = format!(" {} ", text.split_whitespace().collect::<Vec<_>>().join(" "));
    let is_in = |term: &&Term| term.words.iter().any(|word| text.contains(&format!(" {word} ")));
    let mut found = terms.iter().filter(is_in);
    match (found.next(), found.next()) {
        (Some(one), None) => Some(one),
        _ => None,
    }
}

/// A unit in two vocabularies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitTerm {
    /// As palpate writes it.
    pub symbol: &'static str,
    /// Identifier in the Units of Measurement Ontology.
    uo: &'static str,
    /// Name in QUDT.
    qudt: &'static str,
}

impl UnitTerm {
    #[must_use]
    pub fn uo_address(&self) -> String {
        format!("http://purl.obolibrary.org/obo/UO_{}", self.uo)
    }

    #[must_use]
    pub fn qudt_address(&self) -> String {
        format!("http://qudt.org/vocab/unit/{}", self.qudt)
    }
}

const fn unit(symbol: &'static str, uo: &'static str, qudt: &'static str) -> UnitTerm {
    UnitTerm { symbol, uo, qudt }
}

const UNITS: [UnitTerm; 7] = [
    unit("N", "0000108", "N"),
    unit("mm", "0000016", "MilliM"),
    unit("s", "0000010", "SEC"),
    unit("V", "0000218", "V"),
    unit("h", "0000032", "HR"),
    unit("days", "0000033", "DAY"),
    unit("degrees Celsius", "0000027", "DEG_C"),
];

/// The unit with this symbol.
#[must_use]
pub fn unit_term(symbol: &str) -> Option<&'static UnitTerm> {
    UNITS.iter().find(|unit| unit.symbol == symbol)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::metadata::{METADATA_KEYS, MetadataKind};

    #[test]
    fn words_of_a_session_find_their_terms() {
        assert_eq!(species("Pig, Large White").map(|one| one.code), Some("NCBITaxon:9823"));
        assert_eq!(organ("pig liver, left lobe").map(|one| one.code), Some("UBERON:0002107"));
        assert_eq!(organ("skeletal muscle").map(|one| one.code), Some("UBERON:0001134"));
        let address = organ("skin").map(Term::address);
        assert_eq!(address.as_deref(), Some("http://purl.obolibrary.org/obo/UBERON_0002097"));
        for nothing in ["gelatin", "", "deliver", "liver and kidney"] {
            assert_eq!(organ(nothing), None, "{nothing}");
        }
    }

    #[test]
    fn every_unit_of_an_entry_has_its_term() {
        for key in METADATA_KEYS {
            if let MetadataKind::Number { unit, .. } = key.kind {
                assert!(unit_term(unit).is_some(), "{}: {unit}", key.name);
            }
        }
    }
}
