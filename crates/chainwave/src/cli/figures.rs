//! Arguments of `figures`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Arguments of `figures`.
#[derive(Debug, Args)]
pub(crate) struct Figures {
    /// A folder of results: of a run, of simulations, of a proof.
    pub(crate) results: PathBuf,
    /// Draw only this figure, by its file name without extension, such as strain-map.
    #[arg(long, value_name = "NAME")]
    pub(crate) only: Option<String>,
    /// Style (TOML): `column_mm`, `page_mm`, `font_pt`, `colour_map` (viridis or gray), `decimal_sign` (point or comma). Keys that are left
    /// out keep their defaults.
    #[arg(long, value_name = "STYLE.toml")]
    pub(crate) style: Option<PathBuf>,
    /// File formats to write.
    #[arg(long, value_delimiter = ',', default_values_t = FigureFormat::ALL)]
    pub(crate) format: Vec<FigureFormat>,
}

/// A kind of file that a figure is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum FigureFormat {
    /// Scalable.
    Svg,
    /// 300 pixels per inch.
    Png,
    /// For typesetting.
    Pdf,
    /// The numbers drawn.
    Csv,
}

impl FigureFormat {
    const ALL: [Self; 4] = [Self::Svg, Self::Png, Self::Pdf, Self::Csv];
}

impl std::fmt::Display for FigureFormat {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.write_str(match self {
            Self::Svg => "svg",
            Self::Png => "png",
            Self::Pdf => "pdf",
            Self::Csv => "csv",
        })
    }
}
