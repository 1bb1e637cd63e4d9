//! The page: one document of HTML, CSS and JavaScript, with a policy that lets nothing else run and nothing leave the machine.

use crate::error::ViewError;
use crate::refusal::Refusal;
use crate::replies::Reply;

const HTML: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const WAVE_HTML: &str = include_str!("page/wave.html");
const WAVE_STYLE: &str = include_str!("page/wave.css");
const WAVE_MAP: &str = include_str!("page/wave_map.js");
/// In the order in which they run; together they are one script.
const SCRIPTS: [&str; 9] = [
    include_str!("page/state.js"),
    include_str!("page/frames.js"),
    include_str!("page/draw.js"),
    include_str!("page/subsets.js"),
    include_str!("page/review.js"),
    include_str!("page/set_up.js"),
    WAVE_MAP,
    include_str!("page/wave.js"),
    include_str!("page/controls.js"),
];

/// The page, its parts put into one another.
pub(crate) fn page() -> Result<Reply, Refusal> {
    let nonce = nonce().map_err(|error| Refusal::new(500, "/", "random numbers", error.to_string()))?;
    let html = HTML
        .replace("<!-- WAVE -->", WAVE_HTML)
        .replace("/* STYLE */", &[STYLE, WAVE_STYLE].concat())
        .replace("/* SCRIPT */", &SCRIPTS.concat())
        .replace("NONCE", &nonce);
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src 'self' blob: data:; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    Ok(Reply::new("text/html; charset=utf-8", html.into_bytes())
        .with_header("Content-Security-Policy", policy))
}

/// The map of a wave by itself, with its data: a piece of somebody else's page, which needs no server. The page defines the colours `--ink`,
/// `--soft`, `--line`, `--field` and `--accent`.
pub(crate) fn wave_section(data: &serde_json::Value) -> String {
    format!(
        "<style>{WAVE_STYLE}</style>{WAVE_HTML}<script>\"use strict\";\n{WAVE_MAP}\nshowWave({data});</script>"
    )
}

fn nonce() -> Result<String, ViewError> {
    Ok(crate::access::Token::random()?.as_str().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_small_and_asks_nothing_of_others() {
        let page = String::from_utf8(page().unwrap().body).unwrap();
        // What issue 19 allows a page without a framework.
        assert!(page.len() < 200_000, "{} bytes", page.len());
        assert!(
            !page.contains("NONCE") && !page.contains("/* S") && !page.contains("<!-- W"),
            "every part stands where it belongs"
        );
        for outside in ["http://", "https://", "//cdn", "@import", "url("] {
            let found = page.find(outside).map(|at| &page[at..(at + 60).min(page.len())]);
            assert_eq!(found, None, "{outside}");
        }
        for inline in [" onclick=", " onload=", " style=", "eval(", "innerHTML"] {
            assert!(
                !page.contains(inline),
                "the policy forbids {inline}, or names of files could come to life there"
            );
        }
    }
}
