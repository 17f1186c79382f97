//! Angles and firing times that are built in: columns of numbers under a line of names.

/// A table.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    names: Vec<&'static str>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a table that is built in.
    pub fn built_in(text: &'static str) -> Self {
        let mut lines = text.lines();
        let names = lines.next().unwrap_or_default().split(',').collect();
        let number = |cell: &str| cell.parse().expect("the built-in tables are sound");
        let rows = lines.map(|line| line.split(',').map(number).collect());
        Self {
            names,
            rows: rows.collect(),
        }
    }

    /// Values of a column; `None` where there is none of this name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let place = self.names.iter().position(|known| *known == name)?;
        Some(self.rows.iter().map(|row| row[place]).collect())
    }

    /// A column of degrees in radians.
    pub fn radians(&self, name: &str) -> Option<Vec<f64>> {
        let degrees = self.column(name)?;
        Some(degrees.into_iter().map(f64::to_radians).collect())
    }

    /// A column of microseconds in nanoseconds.
    pub fn nanos(&self, name: &str) -> Option<Vec<i64>> {
        let micros = self.column(name)?;
        Some(
            micros
                .into_iter()
                .map(|us| (us * 1000.0).round() as i64)
                .collect(),
        )
    }
}
