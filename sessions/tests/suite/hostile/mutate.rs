//! Mutations of bytes: by disks and transfers, and by an attacker who looks for a
//! parser's mistakes.

use crate::support::Random;

/// What a bad disk or a bad transfer does to a file; returns what it was.
pub fn damage(bytes: &mut Vec<u8>, random: &mut Random) -> String {
    if bytes.is_empty() {
        bytes.push(random.next() as u8);
        return "a byte in an empty file".into();
    }
    let place = random.below(bytes.len());
    let stop = |length: usize| (place + 1 + length).min(bytes.len());
    let (short, long) = (stop(random.below(16)), stop(random.below(512)));
    let what = match random.below(8) {
        0 => {
            bytes.truncate(place);
            "cut off"
        }
        1 => {
            let tail = bytes.len() - random.below(4096.min(bytes.len()));
            bytes[tail..].fill(0);
            "zeros to the end"
        }
        2 | 3 => {
            bytes[place] ^= 1 << random.below(8);
            "a flipped bit"
        }
        4 => {
            bytes[place..short].fill_with(|| random.next() as u8);
            "a burst"
        }
        5 => {
            bytes[place..short].fill(0xff);
            "ones"
        }
        6 => {
            bytes.drain(place..long);
            "a piece missing"
        }
        _ => {
            let repeated = bytes[place..long].to_vec();
            bytes.splice(place..place, repeated);
            "a piece twice"
        }
    };
    format!("{what} at byte {place}")
}

/// An input made of a file of the corpus, pieces of others, and words that mean something to the parser.
pub fn input(corpus: &[(String, Vec<u8>)], words: &[&[u8]], random: &mut Random) -> Vec<u8> {
    let mut bytes = corpus[random.below(corpus.len())].1.clone();
    for _ in 0..=random.below(4) {
        change(&mut bytes, corpus, words, random);
    }
    bytes.truncate(INPUT_MAX);
    bytes
}

/// Larger inputs reach nothing that these do not.
const INPUT_MAX: usize = 64 << 10;

/// Numbers at which lengths and counts go wrong.
const EDGES: [u64; 8] = [0, 1, 0x7f, 0xffff, 0x7fff_ffff, 0xffff_ffff, u64::MAX >> 1, u64::MAX];

fn change(bytes: &mut Vec<u8>, corpus: &[(String, Vec<u8>)], words: &[&[u8]], random: &mut Random) {
    let place = random.below(bytes.len() + 1);
    match random.below(5) {
        0 => {
            let edge = EDGES[random.below(EDGES.len())].to_le_bytes();
            let width = [1, 2, 4, 8][random.below(4)];
            overwrite(bytes, place, &edge[..width]);
        }
        1 => {
            let other = &corpus[random.below(corpus.len())].1;
            let from = random.below(other.len() + 1);
            let to = (from + random.below(256)).min(other.len());
            bytes.splice(place..place, other[from..to].iter().copied());
        }
        2 if !words.is_empty() => {
            let word = words[random.below(words.len())];
            match random.below(2) {
                0 => drop(bytes.splice(place..place, word.iter().copied())),
                _ => overwrite(bytes, place, word),
            }
        }
        _ => drop(damage(bytes, random)),
    }
}

fn overwrite(bytes: &mut [u8], place: usize, with: &[u8]) {
    for (to, from) in bytes.iter_mut().skip(place).zip(with) {
        *to = *from;
    }
}
