//! The parts of an equation, as MathML writes them: signs with the room that TeX gives them, letters, names and spaces.

/// What a part of an equation is to its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    Ordinary,
    /// A sum, which MathML gives room by itself.
    Sum,
    /// A function named in letters.
    Function,
    /// Between two operands, or in front of one.
    Binary,
    Relation,
    Opening,
    Closing,
    Punctuation,
    Space,
}

/// A part of an equation.
#[derive(Debug, Clone)]
pub(super) struct Atom {
    pub(super) class: Class,
    pub(super) set: Set,
}

/// How it is written.
#[derive(Debug, Clone)]
pub(super) enum Set {
    /// A sign whose room depends on its neighbours.
    Sign(&'static str),
    /// An element.
    Element(String),
}

impl Atom {
    pub(super) fn sign(class: Class, sign: &'static str) -> Self {
        Self { class, set: Set::Sign(sign) }
    }

    pub(super) fn element(class: Class, element: impl Into<String>) -> Self {
        Self { class, set: Set::Element(element.into()) }
    }

    pub(super) fn ordinary(element: impl Into<String>) -> Self {
        Self::element(Class::Ordinary, element)
    }

    /// As it stands behind others.
    pub(super) fn written(&self, before: Option<Class>, in_script: bool) -> String {
        let sign = match &self.set {
            Set::Element(element) => return element.clone(),
            Set::Sign(sign) => sign,
        };
        let has_operand = !matches!(
            before,
            None | Some(
                Class::Sum
                    | Class::Function
                    | Class::Binary
                    | Class::Relation
                    | Class::Opening
                    | Class::Punctuation
            )
        );
        match self.class {
            Class::Binary if !has_operand => {
                format!("<mo form=\"prefix\" lspace=\"0\" rspace=\"0\">{sign}</mo>")
            }
            Class::Binary | Class::Relation | Class::Punctuation if !in_script => format!("<mo>{sign}</mo>"),
            Class::Opening | Class::Closing => format!("<mo stretchy=\"false\">{sign}</mo>"),
            _ => format!("<mo stretchy=\"false\" lspace=\"0\" rspace=\"0\">{sign}</mo>"),
        }
    }
}

pub(super) const THIN: &str = "<mspace width=\"0.17em\"/>";

/// Parts one behind the other.
pub(super) fn joined(atoms: &[Atom], in_script: bool) -> String {
    let mut made = String::new();
    let mut before = None;
    for atom in atoms {
        let is_named_by = |class| (before, atom.class) == (Some(Class::Function), class);
        let names = matches!(before, Some(Class::Ordinary | Class::Closing)) && atom.class == Class::Function;
        if (names || is_named_by(Class::Ordinary) || is_named_by(Class::Function)) && !in_script {
            made += THIN;
        }
        made += &atom.written(before, in_script);
        if atom.class != Class::Space {
            before = Some(atom.class);
        }
    }
    made
}

/// Parts as one element.
pub(super) fn grouped(atoms: &[Atom], in_script: bool) -> String {
    let row = joined(atoms, in_script);
    if atoms.len() == 1 { row } else { format!("<mrow>{row}</mrow>") }
}

/// A sign of one character.
pub(super) fn sign(character: char) -> Option<Atom> {
    let (class, sign) = match character {
        '+' => (Class::Binary, "+"),
        '-' => (Class::Binary, "−"),
        '=' => (Class::Relation, "="),
        '<' => (Class::Relation, "&lt;"),
        '>' => (Class::Relation, "&gt;"),
        '(' => (Class::Opening, "("),
        '[' => (Class::Opening, "&#91;"),
        ')' => (Class::Closing, ")"),
        ']' => (Class::Closing, "&#93;"),
        ',' => (Class::Punctuation, ","),
        ';' => (Class::Punctuation, ";"),
        '|' => (Class::Ordinary, "&#124;"),
        '.' => (Class::Ordinary, "."),
        '/' => (Class::Ordinary, "/"),
        _ => return None,
    };
    Some(Atom::sign(class, sign))
}

/// A command that stands for one sign, letter, name or space.
pub(super) fn symbol(name: &str) -> Option<Atom> {
    let letter = |letter: &str| Some(Atom::ordinary(format!("<mi>{letter}</mi>")));
    let space = |em: &str| Some(Atom::element(Class::Space, format!("<mspace width=\"{em}em\"/>")));
    match name {
        "alpha" => letter("α"),
        "beta" => letter("β"),
        "delta" => letter("δ"),
        "eta" => letter("η"),
        "theta" => letter("θ"),
        "kappa" => letter("κ"),
        "nu" => letter("ν"),
        "xi" => letter("ξ"),
        "pi" => letter("π"),
        "rho" => letter("ρ"),
        "sigma" => letter("σ"),
        "tau" => letter("τ"),
        "phi" => letter("ϕ"),
        "varphi" => letter("φ"),
        "chi" => letter("χ"),
        "omega" => letter("ω"),
        "Delta" => letter("Δ"),
        "Psi" => letter("Ψ"),
        "partial" => letter("∂"),
        "nabla" => letter("∇"),
        "ldots" => letter("…"),
        "," => space("0.17"),
        ";" => space("0.28"),
        " " => space("0.25"),
        "qquad" => space("2"),
        "sum" => Some(Atom::element(Class::Sum, "<mo>∑</mo>")),
        "int" => Some(Atom::element(Class::Sum, "<mo>∫</mo>")),
        "sin" | "cos" | "tanh" | "ln" | "min" => Some(Atom::element(Class::Function, upright(name))),
        _ => {
            let (class, sign) = match name {
                "cdot" => (Class::Binary, "⋅"),
                "pm" => (Class::Binary, "±"),
                "circ" => (Class::Binary, "∘"),
                "approx" => (Class::Relation, "≈"),
                "propto" => (Class::Relation, "∝"),
                "le" => (Class::Relation, "≤"),
                "ll" => (Class::Relation, "≪"),
                "leftarrow" => (Class::Relation, "←"),
                _ => return None,
            };
            Some(Atom::sign(class, sign))
        }
    }
}

/// A word in upright letters: one of several letters is so by itself.
pub(super) fn upright(word: &str) -> String {
    match word.chars().count() {
        1 => format!("<mi mathvariant=\"normal\">{}</mi>", escaped(word)),
        _ => format!("<mi>{}</mi>", escaped(word)),
    }
}

pub(super) fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('|', "&#124;")
}
