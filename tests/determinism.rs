//! The same recordings give the same bytes, for any number of threads.

mod slow {
    use crate::support::command::succeed;
    use crate::support::folder::assert_same;
    use crate::support::laboratory::{Laboratory, evaluation};

    #[test]
    fn recordings_do_not_depend_on_the_number_of_threads() {
        let laboratory = Laboratory::new();
        let (alone, together) = (laboratory.path("alone"), laboratory.path("together"));
        succeed(laboratory.filming(&alone).args(["--jobs", "1"]));
        succeed(laboratory.filming(&together).args(["--jobs", "2"]));
        assert_same(&alone, &together);
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let (alone, together) = (laboratory.path("alone"), laboratory.path("together"));
        succeed(evaluation(&recordings, &alone).args(["--jobs", "1"]));
        // More than the machine has, so that the order of work is shuffled further.
        succeed(evaluation(&recordings, &together).args(["--jobs", "5"]));
        assert_same(&alone, &together);
    }

    #[test]
    fn another_seed_films_other_recordings() {
        // Or the tests above could pass on recordings of nothing.
        let laboratory = Laboratory::new();
        let (one, other) = (laboratory.path("one"), laboratory.path("other"));
        succeed(laboratory.filming(&one).args(["--seed", "7"]));
        succeed(laboratory.filming(&other).args(["--seed", "8"]));
        for name in ["view1_trial1.cine", "truth.parquet"] {
            let read = |folder: &std::path::Path| std::fs::read(folder.join(name)).expect("it was filmed");
            assert_ne!(read(&one), read(&other), "{name}");
        }
    }
}
