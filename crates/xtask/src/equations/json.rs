//! As much of JSON as it takes to change the texts in it: strings are found, decoded and written again, the rest stays as it is.

use std::fmt::Write;

/// The second element of a list, as it is written there.
pub(super) fn second_of_list(text: &str) -> Option<&str> {
    let within = text.trim().strip_prefix('[')?.strip_suffix(']')?;
    let mut depth = 0_usize;
    let mut rest = within;
    while let Some(at) = rest.find(['"', '[', '{', ']', '}', ',']) {
        let (sign, behind) = (rest.as_bytes()[at], &rest[at + 1..]);
        rest = behind;
        match sign {
            b'"' => rest = &rest[length_of_string(rest)? + 1..],
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.checked_sub(1)?,
            _ if depth == 0 => return Some(rest.trim()),
            _ => {}
        }
    }
    None
}

/// The text with each of its strings as a function makes it.
///
/// # Errors
/// What the function says; a string without an end, or with an escape that there is none of.
pub(super) fn map_strings(
    text: &str,
    of_string: impl Fn(&str) -> Result<String, String>,
) -> Result<String, String> {
    let mut made = String::new();
    let mut rest = text;
    while let Some((before, from)) = rest.split_once('"') {
        let length = length_of_string(from).ok_or_else(|| format!("no end of the string {from:.40}"))?;
        let string = decoded(&from[..length]).ok_or_else(|| format!("an escape in {from:.40}"))?;
        made += before;
        made += &encoded(&of_string(&string)?);
        rest = &from[length + 1..];
    }
    Ok(made + rest)
}

/// Bytes up to the quotation mark that ends a string.
fn length_of_string(from: &str) -> Option<usize> {
    let mut escaped = false;
    from.bytes().position(|byte| {
        let ends = byte == b'"' && !escaped;
        escaped = byte == b'\\' && !escaped;
        ends
    })
}

fn decoded(written: &str) -> Option<String> {
    let mut units: Vec<u16> = Vec::with_capacity(written.len());
    let mut characters = written.chars();
    while let Some(character) = characters.next() {
        if character != '\\' {
            units.extend_from_slice(character.encode_utf16(&mut [0; 2]));
            continue;
        }
        let unit = match characters.next()? {
            'n' => 0x0a,
            't' => 0x09,
            'r' => 0x0d,
            'b' => 0x08,
            'f' => 0x0c,
            'u' => {
                let digits: String = characters.by_ref().take(4).collect();
                u16::from_str_radix(&digits, 16).ok().filter(|_| digits.len() == 4)?
            }
            other => u16::try_from(u32::from(other)).ok()?,
        };
        units.push(unit);
    }
    String::from_utf16(&units).ok()
}

fn encoded(text: &str) -> String {
    let mut written = String::with_capacity(text.len() + 2);
    written.push('"');
    for character in text.chars() {
        match character {
            '"' => written.push_str("\\\""),
            '\\' => written.push_str("\\\\"),
            '\n' => written.push_str("\\n"),
            // Writing to a text cannot fail.
            control if control < ' ' => drop(write!(written, "\\u{:04x}", u32::from(control))),
            other => written.push(other),
        }
    }
    written.push('"');
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_of_a_list_is_found_behind_nested_ones() {
        let text = r#"[{"root": "a,[\"b", "of": [1, {"c": 2}]}, {"sections": []}]"#;
        assert_eq!(second_of_list(text), Some(r#"{"sections": []}"#));
        for none in ["[1]", "{}", "", "[\"a]", "[1}, 2]"] {
            assert_eq!(second_of_list(none), None, "{none}");
        }
    }

    #[test]
    fn strings_are_changed_and_the_rest_stays() {
        let text = r#"{"a\n\u00b5\ud83d\ude00\/": ["\\(x\\)", 1.5, null]}"#;
        let same = map_strings(text, |string| Ok(string.to_owned())).unwrap();
        assert_eq!(same, r#"{"a\nµ😀/": ["\\(x\\)", 1.5, null]}"#);
        let longer = map_strings(r#"["x\\"]"#, |string| Ok(format!("{string}\"\t"))).unwrap();
        assert_eq!(longer, r#"["x\\\"\u0009"]"#);
    }

    #[test]
    fn what_is_no_string_is_named() {
        for damaged in ["\"a", "\"\\u12\"", "\"\\ud800\""] {
            assert!(map_strings(damaged, |string| Ok(string.to_owned())).is_err(), "{damaged}");
        }
        assert_eq!(map_strings("\"a\"", |_| Err("why".into())), Err("why".into()));
    }
}
