//! Tables of results for Python: by the Arrow PyCapsule interface, and column by column.

use std::ffi::CStr;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{ArrayRef, Float64Array, LargeStringArray, RecordBatch, RecordBatchIterator, UInt32Array};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{ArrowError, DataType, Field, Schema};
use chainwave_experiment::{ResultTable, Values};
use pyo3::exceptions::{PyKeyError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyList};

const STREAM: &CStr = c"arrow_array_stream";
const SCHEMA: &CStr = c"arrow_schema";

/// A table of results, as Arrow holds it.
#[pyclass(frozen, module = "chainwave._chainwave")]
pub(crate) struct ArrowTable {
    batch: RecordBatch,
}

impl ArrowTable {
    /// The table in Arrow's layout; a lost value is null.
    pub(crate) fn of(table: ResultTable) -> PyResult<Self> {
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) =
            table.columns.into_iter().map(|(name, values)| column(name, values)).unzip();
        let batch =
            RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(|error| refused(&error))?;
        Ok(Self { batch })
    }

    fn column(&self, name: &str) -> PyResult<&ArrayRef> {
        let unknown = || PyKeyError::new_err(format!("no column {name:?}"));
        self.batch.column_by_name(name).ok_or_else(unknown)
    }
}

fn column(name: &str, values: Values) -> (Field, ArrayRef) {
    let array: ArrayRef = match values {
        Values::Texts(values) => Arc::new(LargeStringArray::from(values)),
        Values::Counts(values) => Arc::new(UInt32Array::from(values)),
        Values::MaybeCounts(values) => Arc::new(UInt32Array::from(values)),
        Values::Numbers(values) => Arc::new(Float64Array::from(values)),
        Values::MaybeNumbers(values) => Arc::new(Float64Array::from(values)),
    };
    // Any column may hold nothing, so that tables of one kind have one schema.
    (Field::new(name, arrow_array::Array::data_type(&array).clone(), true), array)
}

fn refused(error: &ArrowError) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

#[pymethods]
impl ArrowTable {
    /// Number of rows.
    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    /// The names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema_ref().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// What a column holds: "f8" numbers, "u4" counts, "text".
    fn kind(&self, name: &str) -> PyResult<&'static str> {
        Ok(match arrow_array::Array::data_type(self.column(name)?) {
            DataType::Float64 => "f8",
            DataType::UInt32 => "u4",
            _ => "text",
        })
    }

    /// The values of a column of numbers or counts, in the machine's byte order (anything where one is null), and a byte for each that is
    /// 1 where it is null; none where no value is.
    fn raw<'py>(
        &self,
        py: Python<'py>,
        name: &str,
    ) -> PyResult<(Bound<'py, PyBytes>, Option<Bound<'py, PyBytes>>)> {
        let array = self.column(name)?;
        let bytes: Vec<u8> = match array.as_any().downcast_ref::<Float64Array>() {
            Some(numbers) => numbers.values().iter().flat_map(|value| value.to_ne_bytes()).collect(),
            None => match array.as_any().downcast_ref::<UInt32Array>() {
                Some(counts) => counts.values().iter().flat_map(|value| value.to_ne_bytes()).collect(),
                None => return Err(PyKeyError::new_err(format!("column {name:?} holds texts"))),
            },
        };
        let mask = arrow_array::Array::nulls(array)
            .map(|nulls| -> Vec<u8> { nulls.iter().map(|is_there| u8::from(!is_there)).collect() });
        Ok((PyBytes::new(py, &bytes), mask.map(|mask| PyBytes::new(py, &mask))))
    }

    /// The texts of a column.
    fn texts<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyList>> {
        let array = self.column(name)?;
        let not_texts = || PyKeyError::new_err(format!("column {name:?} holds numbers"));
        let texts = array.as_any().downcast_ref::<LargeStringArray>().ok_or_else(not_texts)?;
        PyList::new(py, texts.iter().collect::<Vec<_>>())
    }

    /// The schema as an Arrow PyCapsule.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema =
            FFI_ArrowSchema::try_from(self.batch.schema_ref().as_ref()).map_err(|error| refused(&error))?;
        PyCapsule::new_with_value(py, schema, SCHEMA)
    }

    /// The table as an Arrow PyCapsule of one batch; another schema may be asked for, and is not given.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(batches)), STREAM)
    }
}
