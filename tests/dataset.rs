//! Tracks as a data set of Parquet files by velocity, view and trial: the same query by polars, DuckDB and pandas.

mod slow {
    use std::fs;
    use std::path::{Path, PathBuf};

    use polars_core::prelude::*;
    use polars_io::prelude::*;

    use crate::support::command::succeed;
    use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};
    use crate::support::python::Python;

    /// Runs the small experiment and returns where its data set lies.
    fn dataset(laboratory: &Laboratory) -> PathBuf {
        let recordings = laboratory.film();
        let (results, folder) = (laboratory.path("results"), laboratory.path("tracks"));
        succeed(evaluation(&recordings, &results).arg("--dataset").arg(&folder));
        folder
    }

    /// The only folder in a folder whose name begins so, and what stands behind it.
    fn part(folder: &Path, key: &str) -> Vec<(String, PathBuf)> {
        let entries = fs::read_dir(folder).expect("it can be listed").flatten();
        let named = entries.filter_map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            Some((name.strip_prefix(key)?.to_owned(), entry.path()))
        });
        named.collect()
    }

    /// Rows of view 2 that hold, and the median of their sigma.
    fn of_view_2(folder: &Path) -> (usize, f64) {
        let [(_, velocity)] = &part(folder, "velocity=")[..] else { panic!("one velocity in {folder:?}") };
        let (_, view) = part(velocity, "view=").into_iter().find(|(view, _)| view == "2").expect("view 2");
        let mut sigmas = Vec::new();
        for (_, trial) in part(&view, "trial=") {
            for (_, file) in part(&trial, "tracks-") {
                let file = fs::File::open(file).expect("it can be opened");
                let rows = ParquetReader::new(file).finish().expect("it is Parquet");
                let holds = rows.column("status").expect("it is there").str().expect("texts").equal("ok");
                let rows = rows.filter(&holds).expect("one for each row");
                sigmas.extend(
                    rows.column("sigma_x_px").expect("it is there").f64().expect("numbers").iter().flatten(),
                );
            }
        }
        sigmas.sort_by(f64::total_cmp);
        let half = sigmas.len() / 2;
        let median =
            if sigmas.len() % 2 == 0 { 0.5 * (sigmas[half - 1] + sigmas[half]) } else { sigmas[half] };
        (sigmas.len(), median)
    }

    const QUERIES: &str = r#"
import glob, sys
import duckdb, pandas, pyarrow.parquet
folder = sys.argv[1]
files = glob.glob(folder + "/**/*.parquet", recursive=True)
found = pandas.read_parquet(folder, filters=[("view", "==", 2), ("status", "==", "ok")])
print(len(found), found.sigma_x_px.median())
query = f"select count(*), median(sigma_x_px) from read_parquet('{folder}/*/*/*/*.parquet', hive_partitioning = true) where view = 2 and status = 'ok'"
print(*duckdb.sql(query).fetchall()[0])
about = pyarrow.parquet.read_schema(files[0]).field("sigma_x_px").metadata
print(about[b"unit"].decode(), "|", about[b"description"].decode())
print(pyarrow.parquet.ParquetFile(files[0]).metadata.row_group(0).column(4).compression, len(files))
"#;

    #[test]
    fn one_query_gives_one_answer_wherever_it_is_asked() {
        let laboratory = Laboratory::new();
        let folder = dataset(&laboratory);
        let (n_rows, median) = of_view_2(&folder);
        assert!(n_rows > 0 && median > 0.0, "{n_rows} {median}");
        let Some(python) = Python::with(&["duckdb", "pandas", "pyarrow"]) else { return };
        let said = python.run(QUERIES, &[&folder]);
        let lines: Vec<&str> = said.lines().collect();
        for answer in &lines[..2] {
            let (n, sigma) = answer.split_once(' ').expect("two numbers");
            let sigma: f64 = sigma.parse().expect("a number");
            // The same values in another order: the median is one of them, or the mean of two.
            assert!(n.parse() == Ok(n_rows) && (sigma / median - 1.0).abs() < 1e-14, "{answer}");
        }
        assert_eq!(lines[2], "px | Standard uncertainty of x_px");
        assert_eq!(lines[3], format!("SNAPPY {N_RECORDINGS}"));
    }
}
