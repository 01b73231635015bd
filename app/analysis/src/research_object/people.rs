//! People of a crate.

/// Somebody who made a crate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CratePerson {
    pub name: String,
    /// Four groups of four digits; the last digit checks the others.
    pub orcid: Option<String>,
    pub affiliation: Option<String>,
}

impl CratePerson {
    /// The page of the person's ORCID.
    #[must_use]
    pub fn page(&self) -> Option<String> {
        self.orcid.as_ref().map(|orcid| format!("https://orcid.org/{orcid}"))
    }
}

const PAGES: [&str; 2] = ["https://orcid.org/", "http://orcid.org/"];

/// The ORCID of a text, in its usual form.
///
/// The last digit is that of ISO 7064 MOD 11-2, as <https://support.orcid.org> describes the structure of the identifier.
pub(super) fn check_orcid(text: &str) -> Result<String, String> {
    let bare = PAGES.iter().find_map(|page| text.strip_prefix(page)).unwrap_or(text);
    let letters: Vec<char> = bare.chars().filter(|letter| *letter != '-').collect();
    let groups: Vec<&str> = bare.split('-').collect();
    let is_grouped = groups.len() == 4 && groups.iter().all(|group| group.len() == 4);
    let digits: Option<Vec<u32>> =
        letters.iter().take(15).map(|letter| letter.to_digit(10)).collect();
    let (Some(digits), 16, true) = (digits, letters.len(), is_grouped) else {
        return Err(format!(
            "'{text}' is not an ORCID; write 16 digits in four groups, such as 0000-0002-1825-0097"
        ));
    };
    let total = digits.iter().fold(0, |total, digit| (total + digit) * 2 % 11);
    let expected = match (12 - total % 11) % 11 {
        10 => 'X',
        digit => char::from_digit(digit, 10).unwrap_or('0'),
    };
    match letters[15].to_ascii_uppercase() == expected {
        true => Ok(bare.to_ascii_uppercase()),
        false => Err(format!(
            "the last digit of the ORCID {bare} does not fit the others; compare it with the person's page"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_digit_of_an_orcid_is_that_of_the_standard() {
        // Examples of ORCID's own documentation: Carberry, Hawking.
        for orcid in ["0000-0002-1825-0097", "0000-0002-9079-593X"] {
            assert_eq!(check_orcid(orcid).as_deref(), Ok(orcid));
            assert_eq!(check_orcid(&format!("https://orcid.org/{orcid}")).as_deref(), Ok(orcid));
        }
        let mistyped = [
            "0000-0002-1825-0079",
            "0000-0002-1825-009",
            "0000000218250097",
            "Ada",
            "0000-0002-1825-00970",
        ];
        for text in mistyped {
            assert!(check_orcid(text).is_err(), "{text}");
        }
    }
}
