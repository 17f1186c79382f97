//! A small reader of JSON, for the metadata of sensors: values by name, nothing written.

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Json {
    /// `null`, `true` or `false`.
    Word(&'static str),
    /// A number.
    Number(f64),
    /// Text.
    Text(String),
    /// Values in order.
    List(Vec<Json>),
    /// Values by name, in the order of the file.
    Object(Vec<(String, Json)>),
}

/// Deeper than this is no metadata.
const MAX_DEPTH: usize = 32;

impl Json {
    /// Reads a whole text; gives the byte at which it is broken.
    pub fn parse(text: &str) -> Result<Self, usize> {
        let mut reader = Reader {
            bytes: text.as_bytes(),
            at: 0,
        };
        let value = reader.value(0).ok_or(reader.at)?;
        reader.blanks();
        if reader.at == reader.bytes.len() {
            Ok(value)
        } else {
            Err(reader.at)
        }
    }

    /// The member with this name, of an object.
    pub fn get(&self, name: &str) -> Option<&Json> {
        match self {
            Self::Object(members) => members
                .iter()
                .find(|(key, _)| key == name)
                .map(|(_, value)| value),
            _ => None,
        }
    }

    /// A number.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// A whole number that is not negative.
    pub fn count(&self) -> Option<usize> {
        let number = self.number()?;
        (number.fract() == 0.0 && (0.0..=1e9).contains(&number)).then_some(number as usize)
    }

    /// Text.
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// A list of numbers alone; lists within it are joined.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let Self::List(values) = self else {
            return None;
        };
        let mut numbers = Vec::with_capacity(values.len());
        for value in values {
            match value {
                Self::Number(number) => numbers.push(*number),
                other => numbers.extend(other.numbers()?),
            }
        }
        Some(numbers)
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\r' | b'\n')) {
            self.at += 1;
        }
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Passes `byte` behind blanks, if it is next.
    fn pass(&mut self, byte: u8) -> bool {
        self.blanks();
        let is_next = self.peek() == Some(byte);
        self.at += usize::from(is_next);
        is_next
    }

    fn value(&mut self, depth: usize) -> Option<Json> {
        if depth > MAX_DEPTH {
            return None;
        }
        self.blanks();
        match self.peek()? {
            b'{' => self.object(depth),
            b'[' => self.list(depth),
            b'"' => self.string().map(Json::Text),
            b'n' => self.word("null"),
            b't' => self.word("true"),
            b'f' => self.word("false"),
            _ => self.digits(),
        }
    }

    fn object(&mut self, depth: usize) -> Option<Json> {
        self.at += 1;
        let mut members = Vec::new();
        if self.pass(b'}') {
            return Some(Json::Object(members));
        }
        loop {
            self.blanks();
            let name = self.string()?;
            if !self.pass(b':') {
                return None;
            }
            members.push((name, self.value(depth + 1)?));
            if self.pass(b'}') {
                return Some(Json::Object(members));
            }
            if !self.pass(b',') {
                return None;
            }
        }
    }

    fn list(&mut self, depth: usize) -> Option<Json> {
        self.at += 1;
        let mut values = Vec::new();
        if self.pass(b']') {
            return Some(Json::List(values));
        }
        loop {
            values.push(self.value(depth + 1)?);
            if self.pass(b']') {
                return Some(Json::List(values));
            }
            if !self.pass(b',') {
                return None;
            }
        }
    }

    /// Text in quotes; escapes that name no letter become the replacement character.
    fn string(&mut self) -> Option<String> {
        if self.peek()? != b'"' {
            return None;
        }
        self.at += 1;
        let mut bytes = Vec::new();
        loop {
            let byte = self.peek()?;
            self.at += 1;
            match byte {
                b'"' => return Some(String::from_utf8_lossy(&bytes).into_owned()),
                b'\\' => {
                    let letter = self.escape()?;
                    bytes.extend(letter.encode_utf8(&mut [0; 4]).bytes());
                }
                other => bytes.push(other),
            }
        }
    }

    fn escape(&mut self) -> Option<char> {
        let byte = self.peek()?;
        self.at += 1;
        Some(match byte {
            b'n' => '\n',
            b't' => '\t',
            b'r' => '\r',
            b'b' | b'f' => ' ',
            b'u' => {
                let digits = self.bytes.get(self.at..self.at + 4)?;
                self.at += 4;
                let code = u32::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()?;
                char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER)
            }
            other => char::from(other),
        })
    }

    fn word(&mut self, word: &'static str) -> Option<Json> {
        let is_it = self.bytes[self.at..].starts_with(word.as_bytes());
        is_it.then(|| {
            self.at += word.len();
            Json::Word(word)
        })
    }

    fn digits(&mut self) -> Option<Json> {
        let is_part = |byte: &u8| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E');
        let rest = &self.bytes[self.at..];
        let length = rest.iter().take_while(|byte| is_part(byte)).count();
        let number: f64 = str::from_utf8(&rest[..length]).ok()?.parse().ok()?;
        if !number.is_finite() {
            return None;
        }
        self.at += length;
        Some(Json::Number(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_by_name() {
        let text = r#" {"a": {"b": [1, -2.5e1, [3]], "c": "x\u0041\n\"ü"}, "d": null, "e": true} "#;
        let json = Json::parse(text).unwrap();
        let inner = json.get("a").unwrap();
        assert_eq!(
            inner.get("b").unwrap().numbers().unwrap(),
            [1.0, -25.0, 3.0]
        );
        assert_eq!(inner.get("c").unwrap().text(), Some("xA\n\"ü"));
        assert_eq!(json.get("d"), Some(&Json::Word("null")));
        assert_eq!(json.get("f"), None);
        assert_eq!(Json::parse("[16]").unwrap().count(), None);
        assert_eq!(Json::parse("16").unwrap().count(), Some(16));
    }

    #[test]
    fn broken_text_is_refused_where_it_breaks() {
        assert_eq!(Json::parse("{\"a\": 1,}"), Err(8));
        assert!(Json::parse("{\"a\": 1} x").is_err());
        assert!(Json::parse(&"[".repeat(10_000)).is_err());
        let whole = r#"{"a": {"b": [1, -2.5e1, [3]], "c": "x\u0041"}}"#;
        for end in 0..whole.len() {
            assert!(Json::parse(&whole[..end]).is_err(), "{end}");
        }
    }
}
