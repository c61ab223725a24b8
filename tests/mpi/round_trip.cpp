// Prints the shortest round trip, in microseconds, between rank 0 and each other rank.
#define OMPI_SKIP_MPICXX 1
#include <mpi.h>

#include <algorithm>
#include <cstdio>

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  char byte = 0;
  for (int other = 1; other < size; ++other) {
    double shortest_s = 1e9;
    for (int trial = 0; trial < 20; ++trial) {
      if (rank == 0) {
        const double start_s = MPI_Wtime();
        MPI_Send(&byte, 1, MPI_BYTE, other, 0, MPI_COMM_WORLD);
        MPI_Recv(&byte, 1, MPI_BYTE, other, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        shortest_s = std::min(shortest_s, MPI_Wtime() - start_s);
      } else if (rank == other) {
        MPI_Recv(&byte, 1, MPI_BYTE, 0, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        MPI_Send(&byte, 1, MPI_BYTE, 0, 0, MPI_COMM_WORLD);
      }
    }
    if (rank == 0) std::printf("%.0f\n", 1e6 * shortest_s);
  }
  MPI_Finalize();
}
