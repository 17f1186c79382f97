//! Where every unknown of an adjustment stands in its vector; all but the rig are in standard deviations.

/// How many there are of each kind.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Unknowns that all states share.
    pub shared: usize,
    /// Unknowns of each hold.
    pub own: Vec<usize>,
    /// Coefficients of the sway in time of each hold, per mode.
    pub knots: Vec<usize>,
    /// Modes of the sway.
    pub modes: usize,
    /// Channels of each lidar.
    pub channels: Vec<usize>,
    /// Unknowns of the surface.
    pub shape: usize,
}

/// Unknowns of a lidar beside its channels: pose, elevation, scale.
pub const RIG: usize = 8;
/// Range errors of a lidar on the blade: against the yard's, and with the slant of the surface.
pub const RANGES: usize = 2;

impl Layout {
    /// First unknown of a hold.
    pub fn own_at(&self, hold: usize) -> usize {
        self.shared + self.own[..hold].iter().sum::<usize>()
    }

    /// First unknown of the sway of a hold: knots by mode.
    pub fn sway_at(&self, hold: usize) -> usize {
        let before: usize = self.knots[..hold].iter().sum();
        self.own_at(self.own.len()) + before * self.modes
    }

    /// The offset of a lidar's clock.
    pub fn clock_at(&self, lidar: usize) -> usize {
        self.sway_at(self.knots.len()) + lidar
    }

    /// First unknown of a lidar: rotation, translation, elevation, scale, channels.
    pub fn lidar_at(&self, lidar: usize) -> usize {
        let before: usize = self.channels[..lidar].iter().map(|c| c + RIG).sum();
        self.clock_at(self.channels.len()) + before
    }

    /// Number of unknowns of all lidars.
    pub fn rig_len(&self) -> usize {
        self.lidar_at(self.channels.len()) - self.lidar_at(0)
    }

    /// First unknown of the surface.
    pub fn shape_at(&self) -> usize {
        self.lidar_at(self.channels.len())
    }

    /// The angle by which edges lie outside of the silhouette.
    pub fn edge_at(&self) -> usize {
        self.shape_at() + self.shape
    }

    /// The same of one hold, lidar and side, from that.
    pub fn edge_offset_at(&self, hold: usize, lidar: usize, side: usize) -> usize {
        self.edge_at() + 1 + 2 * (hold * self.channels.len() + lidar) + side
    }

    /// Hold, lidar and side of an edge offset; none for another unknown.
    pub fn edge_group(&self, unknown: usize) -> Option<(usize, usize, usize)> {
        let first = self.edge_at() + 1;
        let is_one = (first..self.range_at(0)).contains(&unknown);
        let lidars = self.channels.len();
        is_one.then(|| {
            let group = (unknown - first) / 2;
            (group / lidars, group % lidars, (unknown - first) % 2)
        })
    }

    /// First unknown of the range errors of a lidar on the blade.
    pub fn range_at(&self, lidar: usize) -> usize {
        self.edge_offset_at(self.own.len(), 0, 0) + RANGES * lidar
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.range_at(self.channels.len())
    }

    /// Whether there is none: never.
    pub fn is_empty(&self) -> bool {
        false
    }
}
