#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/report/gnuplot.h"

namespace vog {

/// Runs that belong together, by their metrics.
struct ErrorGroup {
  std::string name;
  std::vector<const nlohmann::ordered_json*> metrics;
};

/// RMSE of each run's three maps, side by side in each group; a line joins those of a run.
Picture DrawMapErrors(const std::vector<ErrorGroup>& groups);

/// The errors of the runs' maps with closures over those of their other two, a square each, in the
/// groups' colours: what lies below the line is better with closures.
Picture DrawPairedErrors(const std::vector<ErrorGroup>& groups);

/// Colours that tell groups apart, to colour-blind eyes too; again from the first on where there
/// are more groups than colours.
const char* GroupColour(std::size_t group);

}  // namespace vog
