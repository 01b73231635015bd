//! A text that was cut off within its last number still reads as one, a shorter one.

/// Lines before the last that tell how many digits are usual.
const LINES_LOOKED_AT: usize = 100;

/// What to say of a text without a line end whose last number has fewer digits than nine of ten numbers above it.
/// `last_cell` is the last cell of a line.
pub(super) fn remark(text: &str, last_cell: impl Fn(&str) -> Option<String>) -> Option<String> {
    if text.ends_with(['\n', '\r']) {
        return None;
    }
    let numbers = |line: &str| last_cell(line).filter(|cell| is_number(cell));
    let mut lines = text.lines().rev().filter(|line| !line.trim().is_empty());
    let last = numbers(lines.next()?)?;
    let above: Vec<String> = lines.take(LINES_LOOKED_AT).map_while(numbers).collect();
    // Where numbers have decimals, those before the sign come and go.
    let has_decimals = above.iter().any(|cell| decimals(cell) > 0);
    let digits = |cell: &str| match has_decimals {
        true => decimals(cell),
        false => cell.chars().filter(char::is_ascii_digit).count(),
    };
    let own = digits(&last);
    let longer = above.iter().filter(|cell| digits(cell) > own).count();
    (!above.is_empty() && 10 * longer >= 9 * above.len()).then(|| {
        format!(
            "the file ends without a line end, and its last number '{last}' has fewer digits than those above it; it may be cut off, compare it with the original"
        )
    })
}

fn is_number(cell: &str) -> bool {
    cell.replace(',', ".").parse::<f64>().is_ok()
}

fn decimals(cell: &str) -> usize {
    let behind = cell.split_once(['.', ',']).map_or("", |(_, behind)| behind);
    behind.chars().filter(char::is_ascii_digit).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_last_number_that_is_shorter_than_usual_is_remarked() {
        let last_cell = |line: &str| line.split(';').next_back().map(str::to_owned);
        for (end, is_cut) in [
            ("2;3.4", true),
            ("2;3.", true),
            ("2;3", true),
            ("2;3.4810", false),
            ("2;10.481", false),
            ("2;3.4\n", false),
            ("2;ramp", false),
        ] {
            let text = format!("t;F\n0;9.481\n1;3.482\n{end}");
            let found = remark(&text, last_cell);
            assert_eq!(found.is_some(), is_cut, "{end:?}: {found:?}");
        }
        // Numbers of all lengths have no usual one.
        assert_eq!(remark("t;F\n0;0.1\n1;0.125\n2;0.5", last_cell), None);
        assert!(remark("t;n\n0;1234\n1;1235\n2;12", last_cell).is_some());
        assert_eq!(remark("t;F\n0;0.1", last_cell), None);
    }
}
