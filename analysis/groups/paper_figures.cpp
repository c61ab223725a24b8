#include "analysis/groups/paper_figures.hpp"

namespace soda::analysis {
namespace {

constexpr auto kRagged = models::MapKind::kPaper, kCompact = models::MapKind::kBlocks;

constexpr FigureRow kFigureRows[] = {
    {6, kRagged, 50, 12, {74, 24, 1, 0}},     {6, kRagged, 100, 12, {52, 40, 8, 0}},
    {6, kRagged, 200, 12, {27, 27, 22, 24}},  {6, kRagged, 300, 12, {15, 19, 17, 49}},
    {6, kRagged, 500, 12, {5, 7, 9, 79}},     {6, kRagged, 1000, 12, {1, 1, 2, 97}},
    {6, kCompact, 50, 12, {79, 21, 0, 0}},    {6, kCompact, 100, 12, {64, 36, 0, 0}},
    {6, kCompact, 200, 12, {43, 49, 8, 0}},   {6, kCompact, 300, 12, {34, 37, 25, 4}},
    {6, kCompact, 500, 12, {18, 21, 33, 28}}, {6, kCompact, 1000, 12, {4, 5, 13, 78}},
    {7, kRagged, 500, 12, {5, 9, 12, 74}},    {7, kRagged, 500, 24, {10, 11, 7, 72}},
    {7, kRagged, 500, 48, {23, 25, 14, 39}},  {7, kRagged, 500, 100, {50, 39, 9, 2}},
    {7, kCompact, 500, 12, {22, 16, 40, 22}}, {7, kCompact, 500, 24, {21, 39, 25, 15}},
    {7, kCompact, 500, 48, {34, 38, 17, 11}}, {7, kCompact, 500, 100, {45, 37, 12, 6}},
};

}  // namespace

std::span<const FigureRow> figure_rows() { return kFigureRows; }

}  // namespace soda::analysis
