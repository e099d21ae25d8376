//! Inputs made from the corpus: damaged, cut, spliced, repeated.

/// Longest input, but for the few that are stretched.
const MAX_INPUT: usize = 4096;
/// Longest input of all.
const MAX_STRETCHED: usize = 24 << 10;
/// One input in so many is stretched.
const STRETCHED: usize = 500;

/// splitmix64 (Steele, Lea, Flood 2014).
pub struct Random(u64);

impl Random {
    /// A stream of its own for each name.
    pub fn named(name: &str) -> Self {
        Self(
            name.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3)),
        )
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// From 0 to `end` - 1; 0 where there is nothing.
    pub fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { (self.next() % end as u64) as usize }
    }

    /// One of `from`.
    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }
}

/// Bytes that parsers look for, and numbers that are too large or none.
const WORDS: [&[u8]; 24] = [
    b"\n",
    b"\r\n",
    b"\r\n\r\n",
    b"\0",
    b",",
    b"=",
    b"?",
    b"()",
    b"--",
    b"-1",
    b"NaN",
    b"inf",
    b"1e308",
    b"-0.0",
    b"99999999999999999999",
    b"\xff\xff",
    b"\xff\xd8",
    b"\xff\xd9",
    b"\x7f\xff\xff\xff",
    b"\x7f\xf8\0\0\0\0\0\0",
    b"\x7f\xf0\0\0\0\0\0\0",
    b"\xc3\xa4",
    b"end\n",
    b"def ",
];

/// A range of `bytes`, at most `most` long.
fn range(random: &mut Random, bytes: &[u8], most: usize) -> std::ops::Range<usize> {
    let from = random.below(bytes.len() + 1);
    let length = random.below(most.min(bytes.len() - from) + 1);
    from..from + length
}

/// The next input.
pub fn input(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = random.pick(corpus).clone();
    for _ in 0..=random.below(5) {
        change(random, corpus, &mut bytes);
        bytes.truncate(MAX_INPUT);
    }
    if random.below(STRETCHED) == 0 && !bytes.is_empty() {
        let piece = bytes[range(random, &bytes, 64)].to_vec();
        let at = random.below(bytes.len() + 1);
        let times = random.below(MAX_STRETCHED / (piece.len() + 1));
        bytes.splice(at..at, piece.repeat(times));
        bytes.truncate(MAX_STRETCHED);
    }
    bytes
}

fn change(random: &mut Random, corpus: &[Vec<u8>], bytes: &mut Vec<u8>) {
    let at = random.below(bytes.len());
    match random.below(10) {
        0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
        2 if !bytes.is_empty() => {
            bytes[at] = *random.pick(&[0, 1, 2, 3, 9, 10, 13, 32, 0x7f, 0x80, 0xfe, 0xff]);
        }
        // Where a length may stand: two or four bytes, near a right one or far from it.
        3 => {
            let width = *random.pick(&[1, 2, 4, 8]);
            if let Some(field) = bytes.get_mut(at..at + width) {
                let near = (random.below(9) as u64).wrapping_sub(4);
                let old = field.iter().fold(0_u64, |n, b| n << 8 | u64::from(*b));
                let value =
                    *random.pick(&[old.wrapping_add(near), near, u64::MAX, 0x7fff_ffff, 0x8000_0000, 3]);
                field.copy_from_slice(&value.to_be_bytes()[8 - width..]);
            }
        }
        4 => {
            let cut = range(random, bytes, 32);
            bytes.drain(cut);
        }
        5 => {
            let copied = bytes[range(random, bytes, 64)].to_vec();
            bytes.splice(at..at, copied);
        }
        6 => {
            let other = random.pick(corpus);
            let from = other[range(random, other, other.len())].to_vec();
            let into = range(random, bytes, 16);
            bytes.splice(into, from);
        }
        7 => bytes.truncate(at),
        8 => {
            let word = *random.pick(&WORDS);
            let over = range(random, bytes, word.len());
            bytes.splice(over, word.iter().copied());
        }
        _ => {
            let other = random.pick(corpus);
            bytes.extend_from_slice(other);
        }
    }
}

/// The input in pieces, as a network cuts it.
pub fn pieces<'a>(random: &mut Random, bytes: &'a [u8]) -> Vec<&'a [u8]> {
    // A long input byte by byte takes its time and shows nothing that a short one does not.
    let sizes: &[usize] = if bytes.len() > 600 { &[64, 1500] } else { &[1, 2, 7, 64] };
    let longest = *random.pick(sizes);
    let mut pieces = Vec::new();
    let mut rest = bytes;
    while !rest.is_empty() {
        let (piece, after) = rest.split_at((1 + random.below(longest)).min(rest.len()));
        pieces.push(piece);
        rest = after;
    }
    pieces
}

/// A program whose lines and words are doubled, lost, exchanged, and taken from others.
pub fn shuffled(random: &mut Random, programs: &[String]) -> String {
    let mut lines: Vec<String> = random.pick(programs).lines().map(String::from).collect();
    let line_of = |random: &mut Random, of: &[String]| {
        let program: Vec<&str> = random.pick(of).lines().collect();
        random.pick(&program).to_string()
    };
    for _ in 0..=random.below(3) {
        let (i, j) = (random.below(lines.len()), random.below(lines.len()));
        match random.below(6) {
            0 => lines.swap(i, j),
            1 => drop(lines.remove(i)),
            2 => lines.insert(i, lines[j].clone()),
            3 => lines.insert(i, line_of(random, programs)),
            _ => {
                // A word for one of another line.
                let other = line_of(random, programs);
                let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
                let words = |line: &str| -> Vec<String> {
                    line.split(|c| !is_word(c)).filter(|w| !w.is_empty()).map(String::from).collect()
                };
                let (mine, theirs) = (words(&lines[i]), words(&other));
                if !mine.is_empty() && !theirs.is_empty() {
                    let old: &String = random.pick(mine.as_slice());
                    let new: &String = random.pick(theirs.as_slice());
                    lines[i] = lines[i].replacen(old.as_str(), new, 1);
                }
            }
        }
        if lines.is_empty() {
            break;
        }
    }
    lines.join("\n") + "\n"
}
