// Where the program finds what belongs to it: in the build tree beside it, installed by the prefix.
#pragma once

#include <string>

namespace soda::analysis {

// A module that the program loads, e.g. soda_mpi.so. The place where it would be if it is nowhere.
std::string module_file(const std::string& name);

// What stands in the installed data, e.g. scenarios/library/pyramid.json, under just that name: a
// relative path that does not exist, but does among the installed data; for a program in its build
// tree, among the sources, too. Any other stays as it is.
std::string installed(const std::string& path);

}  // namespace soda::analysis
