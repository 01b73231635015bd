//! Identifiers that follow from names, so that the same export gives the same bytes.

use sha2::{Digest, Sha256};

/// An identifier in the form of RFC 9562.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct UniqueId([u8; 16]);

impl UniqueId {
    /// The namespace of addresses (RFC 9562, section 6.6).
    pub const ADDRESSES: Self = Self(0x6ba7_b811_9dad_11d1_80b4_00c0_4fd4_30c8_u128.to_be_bytes());

    /// That of a name in a namespace: version 8, made with SHA-256 (RFC 9562, appendix B.2).
    pub fn of_name(self, name: &str) -> Self {
        let digest = Sha256::new().chain_update(self.0).chain_update(name).finalize();
        let mut bytes = [0; 16];
        bytes.copy_from_slice(&digest[..16]);
        bytes[6] = bytes[6] & 0x0f | 0x80;
        bytes[8] = bytes[8] & 0x3f | 0x80;
        Self(bytes)
    }
}

impl std::fmt::Display for UniqueId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = format!("{:032x}", u128::from_be_bytes(self.0));
        let (a, b, c) = (&digits[..8], &digits[8..12], &digits[12..16]);
        write!(f, "{a}-{b}-{c}-{}-{}", &digits[16..20], &digits[20..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of RFC 9562, appendix B.2.
    #[test]
    fn identifier_of_a_name_is_that_of_the_specification() {
        let domains = UniqueId(0x6ba7_b810_9dad_11d1_80b4_00c0_4fd4_30c8_u128.to_be_bytes());
        assert_eq!(domains.to_string(), "6ba7b810-9dad-11d1-80b4-00c04fd430c8");
        let example = domains.of_name("www.example.com").to_string();
        assert_eq!(example, "5c146b14-3c52-8afd-938a-375d0df1fbf6");
    }
}
