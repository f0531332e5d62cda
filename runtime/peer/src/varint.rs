//! Numbers of seven bits a byte, the lowest first, all bytes but the last marked (LEB128).

/// Bytes of the longest number.
const MAX_BYTES: u32 = u32::BITS.div_ceil(7);

/// Writes a number, as short as it is.
pub(crate) fn write(bytes: &mut Vec<u8>, mut value: u32) {
    while value >= 0x80 {
        bytes.push(0x80 | (value & 0x7f).to_le_bytes()[0]);
        value >>= 7;
    }
    bytes.push(value.to_le_bytes()[0]);
}

/// Bytes of a number.
pub(crate) fn len(value: u32) -> usize {
    let bits = u32::BITS - (value | 1).leading_zeros();
    bits.div_ceil(7) as usize
}

/// The number at the begin of some bytes, and how many it takes; none where there is none, or
/// one that could be written shorter.
pub(crate) fn read(bytes: &[u8]) -> Option<(u32, usize)> {
    let mut value = 0_u64;
    for (i, byte) in (0..MAX_BYTES).zip(bytes) {
        value |= u64::from(byte & 0x7f) << (7 * i);
        if byte & 0x80 == 0 {
            // A last group of zero could have been left out.
            let shortest = *byte != 0 || i == 0;
            let value = u32::try_from(value).ok().filter(|_| shortest)?;
            return Some((value, i as usize + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_one_encoding_each() {
        for value in [0, 1, 127, 128, 16_383, 16_384, 65_535, u32::MAX] {
            let mut bytes = Vec::new();
            write(&mut bytes, value);
            assert_eq!(read(&bytes), Some((value, bytes.len())));
            assert_eq!(len(value), bytes.len());
            assert_eq!(read(&bytes[..bytes.len() - 1]), None, "{value}");
        }
        for wrong in [&[0x80, 0][..], &[0xff; 6], &[0xff, 0xff, 0xff, 0xff, 0x1f]] {
            assert_eq!(read(wrong), None, "{wrong:?}");
        }
    }
}
