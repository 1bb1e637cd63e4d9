//! Pieces of HTML that all parts of the report use.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Text as HTML wants it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Bytes as an address that holds them.
pub(super) fn inlined(media_type: &str, bytes: &[u8]) -> String {
    format!("data:{media_type};base64,{}", STANDARD.encode(bytes))
}

/// A cell of a table.
pub(super) enum Cell {
    /// To the left.
    Text(String),
    /// To the right, digits below digits.
    Number(String),
}

impl Cell {
    pub(super) fn text(text: &str) -> Self {
        Self::Text(escaped(text))
    }
}

/// A table that scrolls by itself where the page is narrow.
pub(super) fn table(heads: &[&str], rows: impl IntoIterator<Item = Vec<Cell>>) -> String {
    let heads: String =
        heads.iter().map(|head| format!("<th scope=\"col\">{}</th>", escaped(head))).collect();
    let cell = |cell: Cell| match cell {
        Cell::Text(text) => format!("<td>{text}</td>"),
        Cell::Number(text) => format!("<td class=\"n\">{text}</td>"),
    };
    let row = |cells: Vec<Cell>| format!("<tr>{}</tr>", cells.into_iter().map(cell).collect::<String>());
    let rows: String = rows.into_iter().map(row).collect();
    format!("<div class=\"wide\"><table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_users_name_is_no_markup() {
        let table = table(&["<b>"], [vec![Cell::text("a < b & \"c\""), Cell::Number("1".into())]]);
        assert!(table.contains("a &lt; b &amp; &quot;c&quot;") && table.contains("&lt;b&gt;"), "{table}");
        assert_eq!(inlined("image/png", b"ab"), "data:image/png;base64,YWI=");
    }
}
