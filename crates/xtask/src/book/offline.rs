//! The rendered book stands by itself: no page of it asks anything of the net.

use std::fs;
use std::io;
use std::path::Path;

/// What stands before the address of something that a browser loads by itself.
const LOADS: [&str; 5] = ["src=\"", "srcset=\"", "url(\"", "url('", "url("];
const NET: [&str; 3] = ["http://", "https://", "//"];

/// What the files of a rendered book would load from the net: a line each.
pub(crate) fn asks_of_the_net(folder: &Path) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(asks_of_the_net(&path)?);
        } else if path.extension().is_some_and(|ending| ending == "html" || ending == "css") {
            let text = fs::read_to_string(&path)?;
            found.extend(loads(&text).into_iter().map(|load| format!("{}: {load}", path.display())));
        }
    }
    Ok(found)
}

/// Addresses on the net that a page or a style sheet loads; one that a reader may follow is none.
fn loads(text: &str) -> Vec<&str> {
    let linked = text.split("<link").skip(1).filter_map(|rest| rest.split('>').next());
    let linked = linked.flat_map(|link| link.split("href=\"").skip(1));
    let loaded = LOADS.into_iter().flat_map(|word| text.split(word).skip(1));
    let address = |rest: &'_ str| rest.find(['"', '\'', ')']).unwrap_or(rest.len());
    let all = linked.chain(loaded).map(|rest| &rest[..address(rest)]);
    all.filter(|address| NET.iter().any(|start| address.starts_with(start))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_browser_loads_is_found() {
        for (text, asked) in [
            ("<script async src=\"https://cdn.example/MathJax.js\"></script>", 1),
            ("<link rel=\"stylesheet\" href=\"//fonts.example/a.css\">", 1),
            ("@import url(http://a.example/b.css); b { background: url('https://a.example/c.png') }", 2),
            (
                "<a href=\"https://a.example/\">there</a> <img src=\"figures/a.png\"> <link href=\"book.css\">",
                0,
            ),
        ] {
            assert_eq!(loads(text).len(), asked, "{text}");
        }
    }
}
