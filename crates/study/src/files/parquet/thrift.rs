//! Thrift's compact protocol, as far as the footer of a Parquet file has it. Nothing is allocated: a length beyond the
//! bytes that are there is an error, and so is a structure deeper than any footer has.

const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCTURE: u8 = 12;
/// The deepest structure of a footer: statistics of a chunk of a row group.
const DEEPEST: u8 = 12;

/// A value, or the fault of the file in words.
pub(super) type Found<T> = Result<T, &'static str>;

const ENDS: &str = "its footer ends too early";
const KIND: &str = "its footer has a value of another kind";

/// The type of a value, as its field or its list says.
#[derive(Clone, Copy)]
pub(super) struct Wire(u8);

/// Bytes that are still to be read.
#[derive(Clone, Copy)]
pub(super) struct Thrift<'a> {
    bytes: &'a [u8],
    depth: u8,
}

impl<'a> Thrift<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, depth: 0 }
    }

    /// The bytes after what was read.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes
    }

    fn byte(&mut self) -> Found<u8> {
        let (first, rest) = self.bytes.split_first().ok_or(ENDS)?;
        self.bytes = rest;
        Ok(*first)
    }

    fn varint(&mut self) -> Found<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("its footer has a number of more than 64 bits")
    }

    fn zigzag(&mut self) -> Found<i64> {
        let number = self.varint()?;
        Ok((number >> 1) as i64 ^ -((number & 1) as i64))
    }

    /// Reads a structure. `each` is told the number and the type of each field, and reads its value or skips it.
    pub(super) fn fields(&mut self, each: &mut dyn FnMut(i64, Wire, &mut Self) -> Found<()>) -> Found<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("its footer is nested too deeply");
        }
        let mut number = 0;
        loop {
            let head = self.byte()?;
            if head == 0 {
                break;
            }
            number = match head >> 4 {
                0 => self.zigzag()?,
                step => number + i64::from(step),
            };
            if !(0..=i64::from(i16::MAX)).contains(&number) {
                return Err("its footer has a field without a number");
            }
            each(number, Wire(head & 15), self)?;
        }
        self.depth -= 1;
        Ok(())
    }

    /// Reads the structure that a field is.
    pub(super) fn structure(
        &mut self,
        wire: Wire,
        each: &mut dyn FnMut(i64, Wire, &mut Self) -> Found<()>,
    ) -> Found<()> {
        if wire.0 == STRUCTURE {
            self.fields(each)
        } else {
            Err(KIND)
        }
    }

    /// Reads the head of a list: how many values follow, each of at least a byte, and their type.
    fn head(&mut self) -> Found<(usize, Wire)> {
        let head = self.byte()?;
        let count = match head >> 4 {
            15 => self.varint()?,
            count => u64::from(count),
        };
        if count > self.bytes.len() as u64 {
            return Err(ENDS);
        }
        Ok((count as usize, Wire(head & 15)))
    }

    /// Reads the list of structures that a field is, at most `limit`: `each` reads one of them by [`Self::fields`].
    pub(super) fn list(&mut self, wire: Wire, limit: usize, each: &mut dyn FnMut(&mut Self) -> Found<()>) -> Found<()> {
        if wire.0 != LIST {
            return Err(KIND);
        }
        let (count, of) = self.head()?;
        if count > limit {
            return Err("its footer has too many columns or groups of rows");
        }
        if count > 0 && of.0 != STRUCTURE {
            return Err(KIND);
        }
        (0..count).try_for_each(|_| each(self))
    }

    /// Reads the whole number that a field is.
    pub(super) fn integer(&mut self, wire: Wire) -> Found<i64> {
        match wire.0 {
            BYTE => Ok(i64::from(self.byte()?.cast_signed())),
            4..=6 => self.zigzag(),
            TRUE => Ok(1),
            FALSE => Ok(0),
            _ => Err(KIND),
        }
    }

    /// Reads the bytes that a field is.
    pub(super) fn binary(&mut self, wire: Wire) -> Found<&'a [u8]> {
        if wire.0 != BINARY {
            return Err(KIND);
        }
        let length = usize::try_from(self.varint()?).map_err(|_| ENDS)?;
        let (own, rest) = self.bytes.split_at_checked(length).ok_or(ENDS)?;
        self.bytes = rest;
        Ok(own)
    }

    /// Passes a value over.
    pub(super) fn skip(&mut self, wire: Wire) -> Found<()> {
        match wire.0 {
            TRUE | FALSE | BYTE | 4..=6 => self.integer(wire).map(drop),
            DOUBLE => (0..8).try_for_each(|_| self.byte().map(drop)),
            BINARY => self.binary(wire).map(drop),
            LIST => {
                let (count, of) = self.head()?;
                self.depth += 1;
                if self.depth > DEEPEST {
                    return Err("its footer is nested too deeply");
                }
                (0..count).try_for_each(|_| match of.0 {
                    TRUE | FALSE => self.byte().map(drop),
                    _ => self.skip(of),
                })?;
                self.depth -= 1;
                Ok(())
            }
            STRUCTURE => self.fields(&mut |_, wire, this| this.skip(wire)),
            _ => Err(KIND),
        }
    }
}
