//! What every page in HTML is made of: one file, whole in itself, read without scripts and printed as it is.
//! Every text goes through [`escape`], so that what people wrote is never markup.

use crate::drawing::{escape, hex};
use crate::tokens::LIGHT;

/// Print on A4 and Letter: nothing is wider than the paper, and figures and rows stay whole. Dark on white whatever the
/// browser is set to.
const STYLE: &str = "\
:root { color-scheme: only light; }
body { font-family: sans-serif; line-height: 1.4; color: $text; background: $ground; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.3rem; border-bottom: 1px solid $quiet; margin-top: 2rem; } h3 { font-size: 1.1rem; } h4 { font-size: 1rem; }
table { border-collapse: collapse; margin: 0.6rem 0; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: $quiet; padding: 0.2rem 0; }
th, td { text-align: left; vertical-align: top; padding: 0.15rem 0.8rem 0.15rem 0; border-bottom: 1px solid $line; }
th[scope=row] { font-weight: normal; color: $quiet; overflow-wrap: break-word; }
figure { margin: 1rem 0; } figcaption { color: $quiet; font-size: 0.9rem; }
pre { overflow-x: auto; font-size: 0.85rem; } code { font-size: 0.85rem; }
svg { max-width: 100%; height: auto; }
@page { margin: 15mm; }
@media print {
  body { max-width: none; margin: 0; padding: 0; font-size: 10pt; }
  pre { white-space: pre-wrap; font-size: 7pt; } code { font-size: 7.5pt; }
  h1, h2, h3, h4 { break-after: avoid; } figure, table, tr { break-inside: avoid; } thead { display: table-header-group; }
  section.session + section.session { break-before: page; }
}";

/// The body of a page under construction.
#[derive(Debug, Default)]
pub struct HtmlBody(String);

impl HtmlBody {
    /// A heading of a level from 1 on.
    pub fn heading(&mut self, level: u8, text: &str) {
        self.0 += &format!("<h{level}>{}</h{level}>\n", escape(text));
    }

    pub fn paragraph(&mut self, text: &str) {
        self.0 += &format!("<p>{}</p>\n", escape(text));
    }

    /// A paragraph with this start tag, alone on its line.
    pub fn paragraph_with_tag(&mut self, start: &str, text: &str) {
        self.0 += &format!("{start}{}</p>\n", escape(text));
    }

    /// A paragraph that must be seen.
    pub fn strong(&mut self, text: &str) {
        self.0 += &format!("<p><strong>{}</strong></p>\n", escape(text));
    }

    /// Sentences one under another; nothing without any.
    pub fn list<'a>(&mut self, items: impl IntoIterator<Item = &'a str>) {
        let items: String =
            items.into_iter().map(|item| format!("<li>{}</li>\n", escape(item))).collect();
        if !items.is_empty() {
            self.0 += &format!("<ul>\n{items}</ul>\n");
        }
    }

    /// Links, each with an address and its words.
    pub fn links<'a>(&mut self, items: impl IntoIterator<Item = (&'a str, &'a str)>) {
        let items = items.into_iter().map(|(to, words)| {
            format!("<li><a href=\"{}\">{}</a></li>\n", escape(to), escape(words))
        });
        let items: String = items.collect();
        if !items.is_empty() {
            self.0 += &format!("<ul>\n{items}</ul>\n");
        }
    }

    /// Lines in columns, as they are.
    pub fn pre(&mut self, text: &str) {
        let lines: Vec<String> = text.lines().map(escape).collect();
        self.0 += &format!("<pre>{}</pre>\n", lines.join("\n"));
    }

    /// Names and values; those without a value are left out.
    pub fn facts(&mut self, caption: &str, facts: &[(&str, String)]) {
        let rows: String = facts
            .iter()
            .filter(|(_, value)| !value.trim().is_empty())
            .map(|(name, value)| {
                let (name, value) = (escape(name), escape(value));
                format!("<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>\n")
            })
            .collect();
        if !rows.is_empty() {
            let caption = escape(caption);
            self.0 += &format!(
                "<table>\n<caption>{caption}</caption>\n<tbody>\n{rows}</tbody>\n</table>\n"
            );
        }
    }

    /// A table whose rows begin with their name.
    pub fn table(&mut self, caption: &str, heads: &[&str], rows: &[Vec<String>]) {
        self.table_with(caption, heads, rows, |_| String::new());
    }

    /// The same, each row with attributes by its index, already escaped.
    pub fn table_with(
        &mut self,
        caption: &str,
        heads: &[&str],
        rows: &[Vec<String>],
        attributes: impl Fn(usize) -> String,
    ) {
        self.whole_table(caption, heads, rows, attributes, |_, _| false);
    }

    /// The same, some cells bold, by row and by column from 1 on.
    pub fn table_with_bold(
        &mut self,
        caption: &str,
        heads: &[&str],
        rows: &[Vec<String>],
        is_bold: impl Fn(usize, usize) -> bool,
    ) {
        self.whole_table(caption, heads, rows, |_| String::new(), is_bold);
    }

    fn whole_table(
        &mut self,
        caption: &str,
        heads: &[&str],
        rows: &[Vec<String>],
        attributes: impl Fn(usize) -> String,
        is_bold: impl Fn(usize, usize) -> bool,
    ) {
        let heads: String =
            heads.iter().map(|head| format!("<th scope=\"col\">{}</th>", escape(head))).collect();
        self.0 += &format!(
            "<table>\n<caption>{}</caption>\n<thead>\n<tr>{heads}</tr>\n</thead>\n<tbody>\n",
            escape(caption)
        );
        for (index, row) in rows.iter().enumerate() {
            let cells: String = row
                .iter()
                .enumerate()
                .map(|(column, cell)| match (column, escape(cell)) {
                    (0, cell) => format!("<th scope=\"row\">{cell}</th>"),
                    (_, cell) if is_bold(index, column) => {
                        format!("<td><strong>{cell}</strong></td>")
                    }
                    (_, cell) => format!("<td>{cell}</td>"),
                })
                .collect();
            self.0 += &format!("<tr{}>{cells}</tr>\n", attributes(index));
        }
        self.0 += "</tbody>\n</table>\n";
    }

    /// A picture that this program drew, and what is to be said of it.
    pub fn figure(&mut self, svg: &str, caption: &str) {
        self.0 += &format!(
            "<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n",
            without_namespace(svg),
            escape(caption)
        );
    }

    /// What belongs together, of a class that the style knows.
    pub fn section(&mut self, class: &str, part: Self) {
        self.0 += &format!("<section class=\"{class}\">\n{}</section>\n", part.0);
    }
}

/// HTML needs no namespace, and the page then names no place in the network.
fn without_namespace(svg: &str) -> String {
    svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1)
}

/// The style in the inks of paper.
fn style() -> String {
    let inks = [
        ("$text", LIGHT.text),
        ("$quiet", LIGHT.text_quiet),
        ("$line", LIGHT.line),
        ("$ground", LIGHT.canvas),
    ];
    inks.iter().fold(STYLE.to_owned(), |style, (name, ink)| style.replace(name, &hex(*ink)))
}

pub fn document(title: &str, body: HtmlBody) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n\
         <style>\n{}\n</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
        escape(title),
        style(),
        body.0
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_wrote_is_text_in_every_part() {
        let hostile = "</pre><script>alert(1)</script>\" onload='x' & \u{202e}so";
        let mut body = HtmlBody::default();
        body.heading(1, hostile);
        body.paragraph(hostile);
        body.strong(hostile);
        body.list([hostile]);
        body.links([(hostile, hostile)]);
        body.pre(hostile);
        body.facts(hostile, &[(hostile, hostile.to_owned())]);
        let rows = [vec![hostile.to_owned(), hostile.to_owned()]];
        body.table_with_bold(hostile, &[hostile], &rows, |_, column| column == 1);
        body.figure("<svg/>", hostile);
        let page = document(hostile, body);
        assert!(!page.contains("<script") && !page.contains("onload='"), "{page}");
        assert!(!page.contains('\u{202e}'));
        assert_eq!(page.matches("&lt;script&gt;").count(), 16);
    }

    #[test]
    fn a_page_names_no_place_in_the_network() {
        let mut body = HtmlBody::default();
        let svg = crate::drawing::Svg::new(10.0);
        let ground = crate::tokens::LIGHT.canvas;
        body.figure(&svg.finish(10.0, ground, "nothing"), "a figure");
        let page = document("a page", body);
        assert!(!page.contains("://"), "{page}");
        assert!(page.contains("<svg width"));
    }
}
