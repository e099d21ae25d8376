//! Words of a column that differ in capitals and blanks alone: one name, written twice.

use std::collections::BTreeMap;

/// Gives all words of one name its most frequent spelling. Returns the spellings that were given up, with the one taken.
pub(super) fn one_of_each(words: &mut [String]) -> Vec<(String, String)> {
    let plain = |word: &str| word.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
    let mut spellings: BTreeMap<String, BTreeMap<&str, usize>> = BTreeMap::new();
    for word in words.iter().filter(|word| !word.is_empty()) {
        *spellings.entry(plain(word)).or_default().entry(word).or_default() += 1;
    }
    let mut given_up = Vec::new();
    for counts in spellings.values().filter(|counts| counts.len() > 1) {
        // The first of the alphabet where two are as frequent.
        let most = counts.iter().rev().max_by_key(|(_, n)| **n).map_or("", |(word, _)| *word);
        let others = counts.keys().filter(|word| **word != most);
        given_up.extend(others.map(|word| ((*word).to_string(), most.to_string())));
    }
    for word in words {
        if let Some((_, taken)) = given_up.iter().find(|(other, _)| other == word) {
            word.clone_from(taken);
        }
    }
    given_up
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_name_has_one_spelling() {
        let mut words: Vec<String> =
            ["gear", "Gear", "gear", "", "rod  a", "Rod a", "ann"].map(Into::into).into();
        let given_up = one_of_each(&mut words);
        assert_eq!(words, ["gear", "gear", "gear", "", "Rod a", "Rod a", "ann"]);
        assert_eq!(given_up, [("Gear".into(), "gear".into()), ("rod  a".into(), "Rod a".into())]);
        assert_eq!(one_of_each(&mut words), []);
    }
}
