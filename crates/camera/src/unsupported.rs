//! Formats that are known and not read: what they are, and how to make of them what can be read.

use crate::candidate::Candidate;
use crate::error::CameraError;

/// A format that is only named.
struct UnsupportedFormat {
    name: &'static str,
    recognises: fn(&[u8]) -> bool,
    hint: &'static str,
}

const UNSUPPORTED_FORMATS: [UnsupportedFormat; 7] = [
    UnsupportedFormat {
        name: "a MATLAB file of version 7.3 (HDF5)",
        recognises: |head| head.starts_with(b"MATLAB 7.3"),
        // HDF5 has MATLAB's dimensions in reverse: frames, columns, rows.
        hint: "save the counts as .npy, frames first, in Python: numpy.save('frames.npy', \
               h5py.File('FILE.mat')['NAME'][:].swapaxes(1, 2)); or in MATLAB each frame by imwrite as 16-bit TIFF into a folder",
    },
    UnsupportedFormat {
        name: "a MATLAB file",
        recognises: |head| head.starts_with(b"MATLAB 5.0") || head.starts_with(b"MATLAB 4.0"),
        hint: "save the counts as .npy, frames first, in Python: numpy.save('frames.npy', \
               numpy.moveaxis(scipy.io.loadmat('FILE.mat')['NAME'], -1, 0).copy()); or in MATLAB each frame by imwrite as 16-bit \
               TIFF into a folder",
    },
    UnsupportedFormat {
        name: "an HDF5 file",
        // Behind a user block of 512 bytes or a power of two more.
        recognises: |head| [0, 512, 1024, 2048].iter().any(|&at| has(head, at, b"\x89HDF\r\n\x1A\n")),
        hint: "save the counts as .npy, in Python: numpy.save('frames.npy', h5py.File('FILE')['NAME'][:].astype('uint16'))",
    },
    UnsupportedFormat {
        name: "a StreamPix sequence (.seq)",
        recognises: |head| head.starts_with(b"\xED\xFE\0\0") && has(head, 4, b"N\0o\0r\0p\0i\0x\0"),
        hint: "export it from StreamPix as a folder of TIFF or as uncompressed AVI",
    },
    UnsupportedFormat {
        name: "a FLIR sequence (.seq)",
        recognises: |head| head.starts_with(b"FFF\0"),
        hint: "export it from the camera's program as a folder of 16-bit TIFF",
    },
    UnsupportedFormat {
        name: "a Princeton Instruments file (.spe)",
        recognises: |head| has(head, 2996, &0x0123_4567_u32.to_le_bytes()) && has(head, 4098, &[0x55, 0x55]),
        hint: "export it from LightField or WinSpec as TIFF; where its counts are of 16 bits, they can also be read as raw pixels once \
               the header of 4100 bytes is cut off",
    },
    UnsupportedFormat {
        name: "a GIF",
        recognises: |head| head.starts_with(b"GIF8"),
        hint: "a GIF keeps 256 colours; export the recording again as TIFF",
    },
];

/// The error for a file of a format that is known and not read; `None` for any other.
pub(crate) fn refusal(candidate: &Candidate) -> Option<CameraError> {
    let format = UNSUPPORTED_FORMATS.iter().find(|format| (format.recognises)(&candidate.head))?;
    Some(CameraError::Unsupported {
        path: candidate.path.into(),
        what: format.name.into(),
        hint: format.hint.into(),
    })
}

fn has(head: &[u8], at: usize, mark: &[u8]) -> bool {
    head.get(at..).is_some_and(|rest| rest.starts_with(mark))
}
