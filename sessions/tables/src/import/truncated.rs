//! Detection of a text that was cut off within its last number, which still parses as a shorter number.

/// Lines before the last that show the usual number of digits.
const LINES_MAX: usize = 100;

/// A remark if a text has no final line end and its last number has fewer digits than nine in ten numbers above it.
/// `last_cell` returns the last cell of a line.
pub(super) fn remark(text: &str, last_cell: impl Fn(&str) -> Option<String>) -> Option<String> {
    if text.ends_with(['\n', '\r']) {
        return None;
    }
    let numbers = |line: &str| last_cell(line).filter(|cell| is_number(cell));
    let mut lines = text.lines().rev().filter(|line| !line.trim().is_empty());
    let last = numbers(lines.next()?)?;
    let above: Vec<String> = lines.take(LINES_MAX).map_while(numbers).collect();
    // With decimals, the digits before the decimal sign vary.
    let has_decimals = above.iter().any(|cell| decimals(cell) > 0);
    let digits = |cell: &str| match has_decimals {
        true => decimals(cell),
        false => cell.chars().filter(char::is_ascii_digit).count(),
    };
    let own = digits(&last);
    let longer = above.iter().filter(|cell| digits(cell) > own).count();
    (!above.is_empty() && 10 * longer >= 9 * above.len()).then(|| {
        format!(
            "the file has no final line end, and its last number '{last}' has fewer digits than those above it; it may be cut off, so compare it with the original"
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
    fn only_an_unusually_short_last_number_is_reported() {
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
        // Numbers of various lengths have no usual one.
        assert_eq!(remark("t;F\n0;0.1\n1;0.125\n2;0.5", last_cell), None);
        assert!(remark("t;n\n0;1234\n1;1235\n2;12", last_cell).is_some());
        assert_eq!(remark("t;F\n0;0.1", last_cell), None);
    }
}
