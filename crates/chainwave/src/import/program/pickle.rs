//! One array out of a Python pickle, without running what the pickle names: only what NumPy writes for an array is understood.
//!
//! A pickle is a program for a machine with a stack (PEP 307, 574; the comments of Python's `pickletools`). Of its calls, those that make an array
//! and its type are known; any other is refused.

use std::rc::Rc;

use super::numpy::{NumpyArray, Wrong};

/// What lies on the stack.
#[derive(Debug, Clone)]
enum Item<'a> {
    /// Where a tuple begins.
    Mark,
    Nothing,
    Truth(bool),
    Whole(i64),
    Text(&'a str),
    Bytes(&'a [u8]),
    Tuple(Rc<[Item<'a>]>),
    /// A function or a class by its module and name.
    Named(&'a str, &'a str),
    /// A type of numbers, such as `f8`, and its order of bytes.
    Kind(String),
    /// An array whose contents follow.
    Unfilled,
    Array(Rc<NumpyArray>),
}

/// The array that a pickle holds.
///
/// # Errors
/// Bytes that are no pickle of one array of numbers.
pub(super) fn array(bytes: &[u8]) -> Result<NumpyArray, Wrong> {
    let mut machine = Machine { bytes, at: 0, stack: Vec::new(), memo: Vec::new() };
    let wrong = |at: usize| {
        (String::from("an array of numbers as NumPy pickles it"), format!("something else at byte {at}"))
    };
    loop {
        let start = machine.at;
        match machine.step() {
            Some(false) => {}
            Some(true) => break,
            None => return Err(wrong(start)),
        }
    }
    match machine.stack.pop() {
        Some(Item::Array(array)) => Ok(array.as_ref().clone()),
        _ => Err(wrong(machine.at)),
    }
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Item<'a>>,
    memo: Vec<Option<Item<'a>>>,
}

impl<'a> Machine<'a> {
    /// Carries out one instruction; true at the last, none where it is not understood.
    fn step(&mut self) -> Option<bool> {
        let instruction = self.take(1)?[0];
        match instruction {
            b'.' => return Some(true),
            // Version of the protocol, and the length of what follows, which says nothing.
            0x80 => drop(self.take(1)?),
            0x95 => drop(self.take(8)?),
            // A buffer that may not be written to is one all the same.
            0x98 => {}
            b'(' => self.stack.push(Item::Mark),
            b'N' => self.stack.push(Item::Nothing),
            0x88 => self.stack.push(Item::Truth(true)),
            0x89 => self.stack.push(Item::Truth(false)),
            b'K' => self.whole(1)?,
            b'M' => self.whole(2)?,
            b'J' => {
                let value = i32::from_le_bytes(self.take(4)?.try_into().ok()?);
                self.stack.push(Item::Whole(value.into()));
            }
            0x8a => {
                let n = self.length(1)?;
                self.whole(n)?;
            }
            0x8c => self.text(1)?,
            b'X' => self.text(4)?,
            b'C' | b'U' => self.some_bytes(1)?,
            b'B' => self.some_bytes(4)?,
            0x8e | 0x96 => self.some_bytes(8)?,
            b')' => self.stack.push(Item::Tuple(Rc::new([]))),
            0x85..=0x87 => {
                let start = self.stack.len().checked_sub(usize::from(instruction - 0x84))?;
                self.tuple_from(start);
            }
            b't' => {
                let mark = self.stack.iter().rposition(|item| matches!(item, Item::Mark))?;
                self.tuple_from(mark + 1);
                self.stack.remove(mark);
            }
            b'c' => {
                let (module, name) = (self.line()?, self.line()?);
                self.stack.push(Item::Named(module, name));
            }
            0x93 => {
                let (Item::Text(name), Item::Text(module)) = (self.stack.pop()?, self.stack.pop()?) else {
                    return None;
                };
                self.stack.push(Item::Named(module, name));
            }
            b'R' => {
                let (Item::Tuple(arguments), Item::Named(module, name)) =
                    (self.stack.pop()?, self.stack.pop()?)
                else {
                    return None;
                };
                self.stack.push(called(module, name, &arguments)?);
            }
            b'b' => {
                let (Item::Tuple(state), item) = (self.stack.pop()?, self.stack.pop()?) else { return None };
                self.stack.push(filled(item, &state)?);
            }
            0x94 => self.memo.push(Some(self.stack.last()?.clone())),
            b'q' => self.remember(1)?,
            b'r' => self.remember(4)?,
            b'h' => self.recall(1)?,
            b'j' => self.recall(4)?,
            _ => return None,
        }
        Some(false)
    }

    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..)?.get(..n)?;
        self.at += n;
        Some(taken)
    }

    /// A length of so many bytes, the lowest first.
    fn length(&mut self, n_bytes: usize) -> Option<usize> {
        let mut bytes = [0; 8];
        bytes.get_mut(..n_bytes)?.copy_from_slice(self.take(n_bytes)?);
        usize::try_from(u64::from_le_bytes(bytes)).ok()
    }

    fn whole(&mut self, n_bytes: usize) -> Option<()> {
        let value = i64::try_from(self.length(n_bytes)?).ok()?;
        self.stack.push(Item::Whole(value));
        Some(())
    }

    fn text(&mut self, n_bytes: usize) -> Option<()> {
        let n = self.length(n_bytes)?;
        let text = std::str::from_utf8(self.take(n)?).ok()?;
        self.stack.push(Item::Text(text));
        Some(())
    }

    fn some_bytes(&mut self, n_bytes: usize) -> Option<()> {
        let n = self.length(n_bytes)?;
        let bytes = self.take(n)?;
        self.stack.push(Item::Bytes(bytes));
        Some(())
    }

    fn line(&mut self) -> Option<&'a str> {
        let n = self.bytes.get(self.at..)?.iter().position(|byte| *byte == b'\n')?;
        let line = std::str::from_utf8(self.take(n)?).ok()?;
        self.take(1)?;
        Some(line)
    }

    fn tuple_from(&mut self, start: usize) {
        let items: Vec<Item<'a>> = self.stack.drain(start..).collect();
        self.stack.push(Item::Tuple(items.into()));
    }

    fn remember(&mut self, n_bytes: usize) -> Option<()> {
        let at = self.length(n_bytes)?;
        // Places are counted up, so that none lies beyond the bytes of the file.
        if at > self.bytes.len() {
            return None;
        }
        let item = self.stack.last()?.clone();
        self.memo.resize_with(self.memo.len().max(at + 1), || None);
        self.memo[at] = Some(item);
        Some(())
    }

    fn recall(&mut self, n_bytes: usize) -> Option<()> {
        let at = self.length(n_bytes)?;
        self.stack.push(self.memo.get(at)?.clone()?);
        Some(())
    }
}

/// What a call gives.
fn called<'a>(module: &str, name: &str, arguments: &[Item<'a>]) -> Option<Item<'a>> {
    match (module, name, arguments) {
        ("numpy", "dtype", [Item::Text(kind), ..]) => Some(Item::Kind((*kind).to_owned())),
        ("numpy.core.multiarray" | "numpy._core.multiarray", "_reconstruct", _) => Some(Item::Unfilled),
        ("numpy.core.numeric" | "numpy._core.numeric", "_frombuffer", arguments) => {
            let [Item::Bytes(bytes), Item::Kind(kind), Item::Tuple(shape), Item::Text(order)] = arguments
            else {
                return None;
            };
            array_of(kind, *order == "F", shape, bytes)
        }
        _ => None,
    }
}

/// What a state makes of an item.
fn filled<'a>(item: Item<'a>, state: &[Item<'a>]) -> Option<Item<'a>> {
    match (item, state) {
        // The version of the state, then the order of bytes.
        (Item::Kind(kind), [Item::Whole(_), Item::Text(order), ..]) => {
            Some(Item::Kind(format!("{order}{kind}")))
        }
        (
            Item::Unfilled,
            [
                Item::Whole(_),
                Item::Tuple(shape),
                Item::Kind(kind),
                Item::Truth(is_fortran),
                Item::Bytes(bytes),
            ],
        ) => array_of(kind, *is_fortran, shape, bytes),
        _ => None,
    }
}

fn array_of<'a>(kind: &str, is_fortran: bool, shape: &[Item<'a>], bytes: &[u8]) -> Option<Item<'a>> {
    let length = |item: &Item<'a>| match item {
        Item::Whole(length) => usize::try_from(*length).ok(),
        _ => None,
    };
    let shape = shape.iter().map(length).collect::<Option<Vec<usize>>>()?;
    Some(Item::Array(Rc::new(NumpyArray::new(kind, is_fortran, shape, bytes).ok()?)))
}
