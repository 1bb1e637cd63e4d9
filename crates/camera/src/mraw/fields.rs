//! The names and values of a .cih (text) or .cihx (XML), with the place of each in the file.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::bytes::Bytes;
use crate::error::CameraError;

const TEXT_MARK: &[u8] = b"#Camera Information Header";
/// Editors put this before a text that they keep in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
const XML_MARK: &[u8] = b"CIHX";
/// Where [`XML_MARK`] stands.
const XML_MARK_AT: usize = 0x100;
/// Deeper than any header goes; a damaged one must not make paths without end.
const MOST_NESTED: usize = 16;

/// The name of a value in a .cih and its path in a .cihx.
#[derive(Clone, Copy)]
pub(super) struct Key {
    pub(super) text: &'static str,
    pub(super) xml: &'static str,
}

/// Whether a file that starts with `head` is a .cih or a .cihx.
pub(super) fn is_header(head: &[u8]) -> bool {
    head.strip_prefix(BYTE_ORDER_MARK).unwrap_or(head).starts_with(TEXT_MARK) || is_xml(head)
}

fn is_xml(head: &[u8]) -> bool {
    head.get(XML_MARK_AT..).is_some_and(|rest| rest.starts_with(XML_MARK))
}

/// The values of a .cih or .cihx, by name.
pub(super) struct HeaderFields {
    path: PathBuf,
    is_xml: bool,
    fields: Vec<Field>,
}

struct Field {
    name: String,
    value: String,
    /// Where the value stands, in bytes from the start of the file.
    offset: usize,
}

impl HeaderFields {
    pub(super) fn read(path: &Path) -> Result<Self, CameraError> {
        let data = std::fs::read(path).map_err(|source| CameraError::Io { path: path.into(), source })?;
        let is_xml = is_xml(&data);
        let fields = if is_xml { xml_fields(path, &data)? } else { text_fields(&data) };
        Ok(Self { path: path.into(), is_xml, fields })
    }

    fn name(&self, key: Key) -> &'static str {
        if self.is_xml { key.xml } else { key.text }
    }

    fn find(&self, key: Key) -> Option<&Field> {
        let name = self.name(key);
        self.fields.iter().find(|field| field.name == name && !field.value.is_empty())
    }

    /// A value as text; `None` when it is missing or empty.
    pub(super) fn text(&self, key: Key) -> Option<&str> {
        self.find(key).map(|field| field.value.as_str())
    }

    /// A value as a number; `None` when it is missing or empty.
    pub(super) fn optional<T: FromStr>(&self, key: Key, expected: &str) -> Result<Option<T>, CameraError> {
        self.find(key).map(|field| field.value.parse().map_err(|_| self.other(key, expected))).transpose()
    }

    /// A value as a number.
    pub(super) fn number<T: FromStr>(&self, key: Key, expected: &str) -> Result<T, CameraError> {
        self.optional(key, expected)?.ok_or_else(|| self.other(key, expected))
    }

    /// The error for a value that is not what was expected, or is missing.
    pub(super) fn other(&self, key: Key, expected: &str) -> CameraError {
        let field = self.find(key);
        CameraError::Malformed {
            path: self.path.clone(),
            what: self.name(key).into(),
            offset: field.map_or(0, |field| field.offset as u64),
            expected: expected.into(),
            found: field.map_or("no such value".into(), |field| format!("`{}`", field.value)),
        }
    }
}

/// Lines of `name : value` up to the first empty one.
fn text_fields(data: &[u8]) -> Vec<Field> {
    let mut fields = Vec::new();
    let mut offset = 0;
    let is_utf8 = data.starts_with(BYTE_ORDER_MARK);
    for line in data.split_inclusive(|&byte| byte == b'\n') {
        let text = if is_utf8 { String::from_utf8_lossy(line).into_owned() } else { latin1(line) };
        if text.trim().is_empty() {
            break;
        }
        if let Some((name, value)) = text.split_once(':') {
            fields.push(Field { name: name.trim().into(), value: value.trim().into(), offset });
        }
        offset += line.len();
    }
    fields
}

/// Text of one byte a character, as the header's program writes it on western machines.
fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// The texts between the tags of the header's XML, named by their path below `<cih>`; of several, each.
fn xml_fields(path: &Path, data: &[u8]) -> Result<Vec<Field>, CameraError> {
    const ROOT: &[u8] = b"<cih>";
    let place = |mark: &[u8]| data.windows(mark.len()).position(|window| window == mark);
    let (Some(start), Some(end)) = (place(ROOT), place(b"</cih>")) else {
        let bytes = Bytes::new(path, data);
        return Err(bytes.malformed("header text", XML_MARK_AT as u64, "<cih> to </cih>", "no such pair"));
    };
    let body = data.get(start + ROOT.len()..end).unwrap_or_default();
    let mut fields = Vec::new();
    let mut nested: Vec<String> = Vec::new();
    let mut offset = start + ROOT.len();
    for piece in body.split(|&byte| byte == b'<') {
        let text = String::from_utf8_lossy(piece);
        if let Some((tag, value)) = text.split_once('>') {
            if tag.starts_with('/') {
                nested.pop();
            } else if !tag.ends_with('/') && !tag.starts_with(['!', '?']) && nested.len() < MOST_NESTED {
                nested.push(tag.split_whitespace().next().unwrap_or_default().into());
                let name = nested.join("/");
                fields.push(Field { name, value: plain(value.trim()), offset });
            }
        }
        offset += piece.len() + 1;
    }
    Ok(fields)
}

/// A text with XML's five escapes undone.
fn plain(text: &str) -> String {
    let escapes = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    escapes.iter().fold(text.to_owned(), |text, (escape, letter)| text.replace(escape, letter))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: Key = Key { text: "Image Width", xml: "imageDataInfo/resolution/width" };
    const TYPE: Key = Key { text: "Color Type", xml: "imageDataInfo/colorInfo/type" };

    fn fields(data: &[u8]) -> Result<HeaderFields, CameraError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), data).unwrap();
        HeaderFields::read(file.path())
    }

    fn wrapped(xml: &str) -> Vec<u8> {
        let mut data = vec![0; XML_MARK_AT];
        data.extend(b"CIHX\x01\0\0\0");
        data.extend(xml.as_bytes());
        data
    }

    #[test]
    fn a_cih_ends_at_its_first_empty_line() {
        let text = b"#Camera Information Header\r\nImage Width : 640\r\nColor Type: Mono\r\nComment : \xB5m\r\n\r\nImage Width : 7\r\n";
        assert!(is_header(text));
        let fields = fields(text).unwrap();
        assert_eq!(fields.number::<usize>(WIDTH, "a width").unwrap(), 640);
        assert_eq!(fields.text(TYPE), Some("Mono"));
        assert_eq!(fields.text(Key { text: "Comment", xml: "" }), Some("\u{B5}m"));
    }

    #[test]
    fn a_byte_order_mark_before_a_cih_says_that_it_is_in_utf_8() {
        let text =
            "\u{FEFF}#Camera Information Header\r\nImage Width : 640\r\nComment : \u{B5}m\r\n".as_bytes();
        assert!(is_header(text));
        let fields = fields(text).unwrap();
        assert_eq!(fields.number::<usize>(WIDTH, "a width").unwrap(), 640);
        assert_eq!(fields.text(Key { text: "Comment", xml: "" }), Some("\u{B5}m"));
    }

    #[test]
    fn a_cihx_is_read_by_the_whole_path() {
        let data = wrapped(
            "<?xml version='1.0'?><cih><imageFileInfo><resolution><width>1</width></resolution></imageFileInfo>\
             <basicInfo><comment></comment><empty/></basicInfo>\
             <imageDataInfo><resolution><width> 1024 </width></resolution><colorInfo><type>A &lt;&amp;lt; B</type>\
             </colorInfo></imageDataInfo></cih>",
        );
        assert!(is_header(&data));
        let fields = fields(&data).unwrap();
        assert_eq!(fields.number::<usize>(WIDTH, "a width").unwrap(), 1024);
        assert_eq!(fields.text(TYPE), Some("A <&lt; B"));
    }

    #[test]
    fn what_is_no_number_is_named_with_its_place() {
        let error = fields(b"#Camera Information Header\nImage Width : wide\n\n").unwrap();
        let message = error.number::<usize>(WIDTH, "a width").unwrap_err().to_string();
        assert!(message.ends_with("Image Width at byte 27: expected a width, found `wide`"), "{message}");
        let message = error.number::<usize>(TYPE, "a colour").unwrap_err().to_string();
        assert!(message.contains("no such value"), "{message}");
        assert!(fields(&wrapped("<cih><imageDataInfo>")).is_err());
        assert!(fields(&wrapped("</cih><cih>")).unwrap().text(WIDTH).is_none());
    }
}
