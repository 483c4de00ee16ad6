//! "Did you mean": the nearest known name.

/// Longer lists of names are cut in messages.
pub const MAX_LISTED: usize = 40;

/// No name longer than this [characters] is compared.
const LONGEST: usize = 64;

/// The known name nearest to `name`, if it is near enough to be a slip of the pen.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = name.chars().count();
    if length > LONGEST {
        return None;
    }
    let limit = match length {
        0..=2 => 1,
        3..=5 => 2,
        _ => 3,
    };
    // names of much different length are far without a comparison of their letters
    let near = known.into_iter().filter(|k| *k != name && k.len().abs_diff(name.len()) <= 4 * limit);
    let scored = near.map(|k| {
        crate::budget::check();
        (distance(name, k), k)
    });
    // Ties go to the name that comes first in the alphabet, so that messages do not depend on any order.
    scored.filter(|(d, k)| *d <= limit && *d < k.chars().count().max(name.chars().count())).min().map(|(_, k)| k)
}

/// "did you mean `x`?" or, without a near name, `otherwise`.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>, otherwise: &str) -> String {
    nearest(name, known).map_or_else(|| otherwise.to_owned(), |k| format!("did you mean `{k}`?"))
}

/// Edit distance with neighbouring swaps (Damerau 1964, restricted); a change of case counts as one edit.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut two_back = vec![0; b.len() + 1];
    let mut back: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let change = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (back[j] + 1).min(row[j - 1] + 1).min(back[j - 1] + change);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(two_back[j - 2] + 1);
            }
        }
        two_back = std::mem::replace(&mut back, row);
    }
    back[b.len()]
}
