//! The command line.

mod compare;
mod export;
mod prove;
mod reading;
mod review;
mod view;
mod watch;

use std::path::PathBuf;

use chainwave_inference::contact_fit;
use clap::{Args, Parser, Subcommand, ValueEnum};

pub(crate) use self::compare::Compare;
pub(crate) use self::export::Export;
pub(crate) use self::prove::{Extremes, Prove};
pub(crate) use self::reading::Reading;
pub(crate) use self::review::Review;
pub(crate) use self::view::View;
pub(crate) use self::watch::Watch;

/// What stands below the commands.
const EXIT_CODES: &str = "\
Exit codes:
  0  all done
  1  some inputs failed, each named on standard error, and the rest is done; for check: there are warnings
  2  nothing could be done: bad arguments, a bad configuration

First steps:
  chainwave inspect SHOT.cine            what a recording holds
  chainwave view FOLDER                  look at recordings, pick subsets
  chainwave init FOLDER                  a first experiment.toml for a folder of recordings
  chainwave check experiment.toml        whether a run makes sense
  chainwave run experiment.toml --out RESULTS";

/// From high-speed recordings of an impacted chain to its wave, every number with its uncertainty.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = EXIT_CODES)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Say nothing on standard error but errors: no progress, no notes. Results are the same.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Print JSON: one object with what the command says, in place of text.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Say what a recording holds.
    Inspect(Inspect),
    /// Find lens distortion and scale from pictures of a board.
    Calibrate(Calibrate),
    /// Follow points through recordings by digital image correlation.
    Track(Track),
    /// Find the displacement field between two images, with strain and a picture.
    Correlate(Correlate),
    /// Fit the contact law to a compression curve.
    Contact(Contact),
    /// Compute the motion of a chain from a scene.
    Simulate(Simulate),
    /// Film a synthetic experiment: recordings with known truth.
    Synthesize(Synthesize),
    /// Say whether a run of an experiment makes sense, before time is spent on it.
    Check(Check),
    /// Say what an experiment will tell before it is filmed or run, what limits it, and which change would help.
    Plan(Plan),
    /// Process an experiment: from recordings to figures, fitted damping and a report.
    Run(Run),
    /// Draw the figures of results again in another style, without computing anything.
    Figures(Figures),
    /// Set an experiment, its models and published numbers beside each other: figures with all of them, and one table.
    Compare(Compare),
    /// Pack results for an archive: an RO-Crate, with the hash of every file.
    Archive(Archive),
    /// Write tables of results in another format: CSV, Parquet, or MATLAB's .mat.
    Export(Export),
    /// Read tracks that another program wrote, merge their trials, and measure the wave.
    Import(Import),
    /// Measure what each method costs on your own scene, and how far it is off.
    Tradeoff(Tradeoff),
    /// Try cases at the ends of what the program takes, each against a truth of its own.
    Extremes(Extremes),
    /// Film and process many synthetic experiments, and count how often stated intervals hold the truth.
    Prove(Prove),
    /// Write a first experiment.toml and trials.csv for a folder of recordings.
    Init(Init),
    /// Show recordings, subsets and tracks in a browser on this machine, and pick subsets.
    View(View),
    /// List the readings of a run that deserve a look, the most doubtful first.
    Review(Review),
    /// Look at each shot as soon as it is saved: clipped, late trigger, body lost, off the other trials.
    Watch(Watch),
    /// Make the small samples of the folder data-samples.
    Samples(Samples),
    /// Print the script that makes a shell complete commands and options.
    Completions(Completions),
    /// Print a page of the manual, for `man -l -`.
    Man(ManPage),
}

impl Command {
    /// Whether it prints what it has to say as it goes, line by line or as a file: there is no object at its end.
    pub(crate) fn speaks_for_itself(&self) -> bool {
        matches!(self, Self::View(_) | Self::Watch(_) | Self::Completions(_) | Self::Man(_))
    }

    /// Whether what is in hand is worth finishing when the user interrupts: a run goes on from there, and a shot is looked at to its end.
    pub(crate) fn finishes_what_is_in_hand(&self) -> bool {
        matches!(self, Self::Run(_) | Self::Prove(_) | Self::Synthesize(_) | Self::Watch(_))
    }
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(crate) struct Inspect {
    /// The recording.
    pub(crate) recording: PathBuf,
    /// Write this frame (from 0) to the file of --out.
    #[arg(long, requires = "out")]
    pub(crate) frame: Option<usize>,
    /// A TIFF file for --frame: linear counts, 16-bit gray, top row first.
    #[arg(long, requires = "frame")]
    pub(crate) out: Option<PathBuf>,
    /// Write a contact sheet of frames to this PNG file.
    #[arg(long)]
    pub(crate) sheet: Option<PathBuf>,
    /// Frames per second of a recording that does not state them, such as a folder of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

/// What is known of the sensor.
#[derive(Debug, Args)]
pub(crate) struct Sensor {
    /// Dark frames of the same camera, exposure and part of the sensor: a recording, a folder of images or one of them. Their
    /// mean is taken off, and hot pixels are filled from their neighbours.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) dark: Option<PathBuf>,
    /// Frames of an evenly lit field, likewise: gains are evened out, and dead pixels filled.
    #[arg(long, value_name = "FRAMES")]
    pub(crate) flat: Option<PathBuf>,
}

/// Arguments of `figures`.
#[derive(Debug, Args)]
pub(crate) struct Figures {
    /// A folder of results: of a run, of simulations, of a proof.
    pub(crate) results: PathBuf,
    /// Draw this figure alone, by its file name without ending, such as strain-map.
    #[arg(long, value_name = "NAME")]
    pub(crate) only: Option<String>,
    /// How they look, as TOML: `column_mm`, `page_mm`, `font_pt`, `colour_map` (viridis or gray), `decimal_sign` (point or comma). What is
    /// left out stays as it is by default.
    #[arg(long, value_name = "STYLE.toml")]
    pub(crate) style: Option<PathBuf>,
    /// Kinds of files to write.
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

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct ManPage {
    /// The command whose page it is; the program's without it.
    pub(crate) command: Option<String>,
    /// Print every command with its options in one page of Markdown.
    #[arg(long, conflicts_with = "command")]
    pub(crate) markdown: bool,
}

/// Arguments of `archive`.
#[derive(Debug, Args)]
pub(crate) struct Archive {
    /// Results of a run.
    pub(crate) results: PathBuf,
    /// A new folder for the package.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// The folder of the recordings, to pack them too; without it they are named by size and hash of their beginning.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Address of the licence under which the package may be used, such as <https://creativecommons.org/licenses/by/4.0/>.
    #[arg(long)]
    pub(crate) license: Option<String>,
    /// Who made the experiment: names, ORCIDs.
    #[arg(long)]
    pub(crate) authors: Option<String>,
}

/// Arguments of `calibrate`.
#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    /// Pictures of the board. In the first it lies in the plane in which the chain moves.
    #[arg(required = true)]
    pub(crate) pictures: Vec<PathBuf>,
    /// What the board shows.
    #[arg(long, value_enum)]
    pub(crate) board: Board,
    /// Squares in a row.
    #[arg(long)]
    pub(crate) columns: usize,
    /// Squares in a column.
    #[arg(long)]
    pub(crate) rows: usize,
    /// Side of a square, in metres.
    #[arg(long)]
    pub(crate) square_m: f64,
    /// Standard uncertainty of that side; it is common to all squares.
    #[arg(long, default_value_t = 0.0)]
    pub(crate) square_sigma_m: f64,
    /// Side of a marker, in metres.
    #[arg(long, required_if_eq("board", "charuco"))]
    pub(crate) marker_m: Option<f64>,
    /// Set of markers as OpenCV names it.
    #[arg(long, default_value = "4X4_50")]
    pub(crate) dictionary: String,
    /// Calibration to write, as TOML.
    #[arg(long)]
    pub(crate) out: PathBuf,
}

/// What a board for calibration shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Board {
    /// Squares.
    Checkerboard,
    /// Squares with ArUco markers in the white ones.
    Charuco,
}

/// Arguments of `track`.
#[derive(Debug, Args)]
pub(crate) struct Track {
    /// The recordings.
    #[arg(required = true)]
    pub(crate) recordings: Vec<PathBuf>,
    /// Table of points: name,x_px,y_px,half_width_px,half_height_px in the reference frame. Where both half sizes are
    /// empty or left out, the smallest subset is taken that keeps the noise within --accuracy (0.01 px when left out) and that cannot be
    /// taken for another; frame and neighbours bound it.
    #[arg(long)]
    pub(crate) points: PathBuf,
    /// Table to write (.csv, .parquet or .mat).
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Picture of how far the points moved over time, without ending: .svg and .png are written.
    #[arg(long, value_name = "STEM")]
    pub(crate) picture: Option<PathBuf>,
    /// Reference frame, from 0.
    #[arg(long, default_value_t = 0)]
    pub(crate) reference: usize,
    /// Frames per second of recordings that do not state them, such as folders of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) sensor: Sensor,
    #[command(flatten)]
    pub(crate) matching: Matching,
    /// Recordings processed at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// How images are matched.
#[derive(Debug, Args)]
pub(crate) struct Matching {
    /// A rung of the ladder, by name.
    #[arg(long)]
    pub(crate) method: Option<String>,
    /// The cheapest rung whose error on these subsets, shifted by known amounts under the same noise, is at most this, in
    /// pixels.
    #[arg(long, value_name = "PX", conflicts_with_all = ["method", "interpolation"])]
    pub(crate) accuracy: Option<f64>,
    /// Shape function: translation, rigid, affine or quadratic, or auto: the simplest that the matches cannot reject.
    #[arg(long, conflicts_with = "method")]
    pub(crate) shape: Option<String>,
    /// Interpolation of the deformed image: linear, cubic, cubic-moms, quintic or quintic-moms.
    #[arg(long, conflicts_with = "method")]
    pub(crate) interpolation: Option<String>,
}

/// Arguments of `correlate`.
#[derive(Debug, Args)]
pub(crate) struct Correlate {
    /// The reference image.
    pub(crate) reference: PathBuf,
    /// The deformed image.
    pub(crate) deformed: PathBuf,
    /// Pixels from one point to the next; half of the half size when left out.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) step: Option<u16>,
    /// Columns and rows of a subset on each side of its centre. When left out, the smallest that keeps the noise within --accuracy (0.01 px
    /// when left out) and that cannot be taken for another, less where the field bends.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(2..=500))]
    pub(crate) half_size: Option<u16>,
    /// Table to write (.csv, .parquet or .mat); pictures of the field go beside it (.svg and .png).
    #[arg(long)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) sensor: Sensor,
    #[command(flatten)]
    pub(crate) matching: Matching,
    /// Points along one side of the square that a strain is measured over; an odd number.
    #[arg(long, value_name = "POINTS", default_value_t = 5, value_parser = clap::value_parser!(u16).range(3..=99))]
    pub(crate) strain_window: u16,
    /// Threads; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `contact`.
#[derive(Debug, Args)]
pub(crate) struct Contact {
    /// Table of the curve: overlap_m,force_n in the order of the measurement, both positive in compression.
    pub(crate) curve: PathBuf,
    /// Law to write, as TOML.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Where overlap and force are zero.
    #[arg(long, value_enum, default_value_t = Zero::Auto)]
    pub(crate) zero: Zero,
}

/// Where overlap and force of a compression curve are zero.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Zero {
    /// Contact where there are readings before it, else load-cell where its offset is real, else stated.
    Auto,
    /// At overlap 0 and force 0, as the curve states.
    Stated,
    /// At overlap 0; the load cell's offset is fitted along.
    LoadCell,
    /// Where the force leaves its level before contact; that overlap is fitted along.
    Contact,
}

impl Zero {
    /// The rule of the fit.
    pub(crate) fn rule(self) -> contact_fit::Zero {
        match self {
            Self::Auto => contact_fit::Zero::Auto,
            Self::Stated => contact_fit::Zero::Stated,
            Self::LoadCell => contact_fit::Zero::LoadCell,
            Self::Contact => contact_fit::Zero::Contact,
        }
    }
}

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// The scene.
    pub(crate) scene: PathBuf,
    /// Table to write (.csv, .parquet or .mat): the motion, or with --scan the pulse in each gap.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Summary to write, as JSON.
    #[arg(long, conflicts_with = "scan")]
    pub(crate) summary: Option<PathBuf>,
    /// Striker velocities in m/s, a list V,V,... or a range FROM:TO:COUNT, in place of the scene's own.
    #[arg(long)]
    pub(crate) scan: Option<crate::simulate::Velocities>,
    /// Members of a scan simulated at a time, or threads of a chain of rings; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `synthesize`.
#[derive(Debug, Args)]
pub(crate) struct Synthesize {
    /// The experiment; its part `synthetic` says what is filmed.
    pub(crate) experiment: PathBuf,
    /// Folder for the recordings, trials.csv, truth.parquet, truth.json and a copy of the experiment.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Seed in place of the experiment's own.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Recordings filmed at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct Check {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder of the recordings that trials.csv names; the experiment's own folder when left out.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Views looked at side by side; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(crate) struct Plan {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder of the recordings that trials.csv names, where some are filmed; the experiment's own folder when left out.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Threads; all cores when left out. The time of a run is predicted for as many.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub(crate) struct Run {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder for tables, figures and the report.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Folder of the recordings that trials.csv names; the experiment's own folder when left out.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Recordings processed at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    /// Take the whole frames of recordings that were cut short, and say how many they are.
    #[arg(long)]
    pub(crate) partial: bool,
    /// Say, stage by stage, what is kept of an earlier run, what is made anew, and why.
    #[arg(long)]
    pub(crate) explain: bool,
    /// Say in the report what the uncertainty of each result comes from, by rehearsals as of `plan`, which take a few times as long as the
    /// evaluation.
    #[arg(long, conflicts_with = "share")]
    pub(crate) budget: bool,
    /// How well a result must be known, such as c_g=0.1% or HWHM=0.2mm (also x_n, c_d, c_s, peak_strain, peak_energy); may be given for several.
    /// Rehearsals then choose the trials, frames, size of subsets and tracking method that are enough, and the run looks at nothing else.
    #[arg(long, value_name = "RESULT=SIGMA", conflicts_with = "share")]
    pub(crate) accuracy: Vec<chainwave_experiment::Aim>,
    /// Only track, and only the K-th of N shares of the recordings: for the tasks of a cluster's array job, which all write into
    /// one folder. A run without it then evaluates what they tracked.
    #[arg(long, value_name = "K/N")]
    pub(crate) share: Option<chainwave_experiment::Share>,
    /// Folder for the tracks once more as a data set of Parquet files, one a recording, by velocity, view and trial (Hive partitions).
    #[arg(long, value_name = "FOLDER", conflicts_with = "share")]
    pub(crate) dataset: Option<PathBuf>,
}

/// Arguments of `import`.
#[derive(Debug, Args)]
pub(crate) struct Import {
    /// What stands where in the files of the trials.
    pub(crate) mapping: PathBuf,
    /// Folder of the files that the mapping names; the mapping's own folder when left out.
    #[arg(long)]
    pub(crate) data: Option<PathBuf>,
    /// Folder for tables, figures and results.json.
    #[arg(long)]
    pub(crate) out: PathBuf,
}

/// Arguments of `tradeoff`.
#[derive(Debug, Args)]
pub(crate) struct Tradeoff {
    /// Experiments (experiment.toml: the bodies of its first recording) or recordings.
    #[arg(required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// Folder for tradeoff.parquet and its figures.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Run each experiment as a whole, as it is stated and with less of one thing at a time, and show the certainty of c_g, HWHM and c_d
    /// against the time of a run; takes some eight runs.
    #[arg(long)]
    pub(crate) results: bool,
    /// Table of points for recordings, as for `track`; when left out, squares of 33 x 33 px with much texture.
    #[arg(long)]
    pub(crate) points: Option<PathBuf>,
    /// Frames per second of recordings that do not state them, such as folders of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

/// Arguments of `init`.
#[derive(Debug, Args)]
pub(crate) struct Init {
    /// Folder of the recordings.
    pub(crate) folder: PathBuf,
}

/// Arguments of `samples`.
#[derive(Debug, Args)]
pub(crate) struct Samples {
    /// Folder to write to.
    #[arg(long, default_value = "data-samples")]
    pub(crate) out: PathBuf,
}
