#!/usr/bin/env bash
# What is installed is used as a stranger would: from an empty folder, with nothing but a prefix.
# Arguments: what to do, build folder, folder of the sources, a scratch folder that the calls share.
# CMAKE, CXX, BUILD_TYPE and GENERATOR are in the environment.
set -euo pipefail
what=$1 build=$2 sources=$3 scratch=$4
prefix=$scratch/prefix kernel_prefix=$scratch/kernel-prefix
mkdir -p "$scratch"
empty=$(mktemp -d "$scratch/empty.XXXXXX")
trap 'rm -rf "$empty"' EXIT
cd "$empty"

configure() {  # folder of sources, folder of the build, prefix, more arguments
  "$CMAKE" -S "$1" -B "$2" -G "$GENERATOR" -DCMAKE_PREFIX_PATH="$3" -DCMAKE_CXX_COMPILER="$CXX" \
    -DCMAKE_BUILD_TYPE="$BUILD_TYPE" "${@:4}"
}

# An example with its prefix; and not without one, else the check would prove nothing.
run_example() {  # name, prefix, arguments of the program
  configure "$sources/examples/$1" build "$2"
  "$CMAKE" --build build
  "build/$1" "${@:3}"
  if configure "$sources/examples/$1" other "$empty/none" >/dev/null 2>&1; then
    echo "found without an installation" >&2
    exit 1
  fi
}

# The numbered blocks of a language in a text, each into a file of its own.
extract_blocks() {  # text, language, ending
  awk -v start="\`\`\`$2" -v end='```' -v suffix="$3" '
    $0 == start { file = sprintf("block%02d.%s", ++count, suffix); inside = 1; next }
    $0 == end { inside = 0 }
    inside { print > file }' "$1"
  compgen -G "block*.$3" >/dev/null || { echo "no block of $2 in $1" >&2; exit 1; }
}

use_python() {
  PYTHONPATH=$(echo "$prefix"/lib/python3.*/site-packages) "$PYTHON" "$@"
}

case $what in
  install)
    rm -rf "$prefix" "$kernel_prefix" "$scratch/first"
    # Moved once: nothing may know where it was installed first.
    "$CMAKE" --install "$build" --prefix "$scratch/first" >/dev/null
    mv "$scratch/first" "$prefix"
    "$CMAKE" --install "$build" --component kernel --prefix "$kernel_prefix" >/dev/null
    ;;
  headers)
    # Each can be included by itself, and there are no others than those of the components.
    cd "$prefix/include"
    for header in $(find . -name '*.hpp' | sort); do
      flags=(-I. -Isoda)
      [[ $header == ./soda/physics/* ]] && flags+=(-isystem /usr/include/eigen3)
      echo "#include \"${header#./}\"" |
        "$CXX" -std=c++20 -Wall -Wextra -Werror -fsyntax-only "${flags[@]}" -x c++ -
    done
    echo "headers: $(find . -path './soda/*/*' -name '*.hpp' | wc -l) of layers," \
      "$(find soda -maxdepth 1 -name '*.hpp' | wc -l) of the library"
    ;;
  kernel-alone)
    # From sources, without any package but a compiler.
    configure "$sources" alone "$empty/none" -DSODA_KERNEL_ONLY=ON -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON \
      -DCMAKE_DISABLE_FIND_PACKAGE_{Eigen3,fcl,Boost,nlohmann_json,CLI11,Qhull,assimp,zstd,GTest}=ON
    "$CMAKE" --build alone
    "$CMAKE" --install alone --prefix "$empty/kernel" >/dev/null
    [[ -e $empty/kernel/share/doc/soda/LICENSE ]]
    run_example queueing "$empty/kernel"
    ;;
  queueing) run_example queueing "$kernel_prefix" ;;
  game_loop | batch) run_example "$what" "$prefix" ;;
  python)
    for example in "$sources"/examples/python/*.py; do use_python "$example"; done
    ;;
  documentation)
    cp "$prefix/share/soda/scenarios/library/pyramid.json" .
    extract_blocks "$sources/docs/embedding.md" cpp cpp
    {
      echo 'cmake_minimum_required(VERSION 3.25)'
      echo 'project(blocks LANGUAGES CXX)'
      echo 'find_package(soda REQUIRED COMPONENTS kernel physics simulation)'
      for block in block*.cpp; do
        echo "add_executable(${block%.cpp} $block)"
        echo "target_link_libraries(${block%.cpp} PRIVATE soda::simulation soda::kernel soda::physics)"
      done
    } >CMakeLists.txt
    configure . build "$prefix"
    "$CMAKE" --build build
    for block in block*.cpp; do (echo "== $block" && "build/${block%.cpp}"); done
    if [[ -n ${PYTHON:-} ]]; then
      extract_blocks "$sources/docs/embedding.md" python py
      for block in block*.py; do (echo "== $block" && use_python "$block"); done
    fi
    ;;
  program)
    "$prefix/bin/soda" run scenarios/library/pyramid.json --steps 10 --quiet | sed -n 1,2p
    "$prefix/bin/soda" accuracy free-fall --repeat 0 | sed -n 1,5p
    # Guides for man and for shells, of the installed cases, too.
    grep -q 'EXIT STATUS' "$prefix/share/man/man1/soda.1"
    for guide in bash-completion/completions/soda zsh/site-functions/_soda \
      fish/vendor_completions.d/soda.fish; do
      grep -q 'free-fall' "$prefix/share/$guide"
    done
    [[ -e $prefix/share/doc/soda/LICENSE ]]
    if [[ -e $prefix/lib/soda/soda_mpi.so ]]; then
      export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
      mpirun -n 2 --oversubscribe "$prefix/bin/soda" run scenarios/library/twelve-worlds.json \
        --steps 10 --executor mpi --quiet | sed -n 1,2p
    fi
    ;;
  *)
    echo "nothing to do for $what" >&2
    exit 2
    ;;
esac
