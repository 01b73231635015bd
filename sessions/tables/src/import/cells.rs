//! Splitting of a line of delimited text into cells (RFC 4180, section 2). A quoted cell must end on its line.

/// Detects the delimiter from the first line.
pub fn delimiter_of(first: &str) -> Result<char, String> {
    let mut is_quoted = false;
    let bare: String = first
        .chars()
        .filter(|&character| {
            is_quoted ^= character == '"';
            !is_quoted
        })
        .collect();
    ['\t', ';', ','].into_iter().find(|delimiter| bare.contains(*delimiter)).ok_or_else(|| {
        "the first line has no delimiter; separate the names of the columns by comma, semicolon or tab".into()
    })
}

/// The cells of line `number`, without quotes and surrounding spaces.
pub fn split(line: &str, delimiter: char, number: usize) -> Result<Vec<String>, String> {
    let mut cells = Vec::new();
    let mut cell = String::new();
    let mut characters = line.chars().peekable();
    let mut is_quoted = false;
    while let Some(character) = characters.next() {
        // A quote within an unquoted cell means inches.
        if character == '"' && (is_quoted || cell.trim().is_empty()) {
            // Two quotes within a quoted cell stand for one.
            if is_quoted && characters.next_if_eq(&'"').is_some() {
                cell.push('"');
            } else {
                is_quoted = !is_quoted;
            }
        } else if character == delimiter && !is_quoted {
            cells.push(cell.trim().to_owned());
            cell.clear();
        } else {
            cell.push(character);
        }
    }
    if is_quoted {
        return Err(format!("line {number}: a quote is not closed; close it on the same line"));
    }
    cells.push(cell.trim().to_owned());
    Ok(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delimiter_in_quotes_is_ignored() {
        assert_eq!(delimiter_of("\"a;b\",c"), Ok(','));
        assert_eq!(delimiter_of("a\tb;c"), Ok('\t'));
        assert!(delimiter_of("\"a,b\"").is_err());
    }

    #[test]
    fn cells_are_split_by_rfc_4180() {
        let inch = split("6\" probe,7", ',', 1).unwrap();
        assert_eq!(inch, ["6\" probe", "7"]);
        let cells = split(" a ,\"b, c\",\"d \"\"e\"\"\",,", ',', 1).unwrap();
        assert_eq!(cells, ["a", "b, c", "d \"e\"", "", ""]);
    }
}
