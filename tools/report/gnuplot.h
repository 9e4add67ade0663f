#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>

namespace vog {

/// SVG for lines, PNG (at twice the size, for sharp screens) for dense clouds.
enum class PictureFormat { kSvg, kPng };

struct Picture {
  PictureFormat format = PictureFormat::kSvg;
  int width_px = 0, height_px = 0;  ///< As it is to be shown.
  std::string bytes;
};

/// What is to be drawn. Commands name the data files as they are called in `data`.
struct Plot {
  PictureFormat format = PictureFormat::kSvg;
  int width_px = 540, height_px = 300;
  std::string commands;
  std::map<std::string, std::string> data;
};

/// Has gnuplot draw, in a folder of its own that is gone afterwards. Equal plots give equal bytes.
/// @throws SystemError when gnuplot is missing or refuses.
Picture DrawPlot(const Plot& plot);

/// Whether PATH leads to gnuplot.
bool HasGnuplot();

/// A line of a data file. What is not finite becomes NaN, which gnuplot leaves out.
std::string DataLine(std::initializer_list<double> numbers);

/// Lines `x y value` of an image's cells, row by row: `x_of` a column, `y_of` a row, `value_of` a
/// cell's number in that order.
template <class XOf, class YOf, class ValueOf>
std::string ImageData(int columns, int rows, XOf x_of, YOf y_of, ValueOf value_of) {
  std::string text;
  std::size_t cell = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      text += DataLine({x_of(column), y_of(row), static_cast<double>(value_of(cell++))});
  return text;
}

/// `text` as a string of gnuplot's, in quotes.
std::string PlotText(std::string_view text);

/// A number for a command or a label: `digits` significant ones at most.
std::string PlotNumber(double value, int digits = 6);

}  // namespace vog
