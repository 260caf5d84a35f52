! Example: a code that keeps its own particles asks for pairs: soft springs between drifting discs.
module springs
   use, intrinsic :: iso_fortran_env, only: int32, real64
   implicit none
   integer, parameter :: discs = 500, steps = 50
   real(real64), parameter :: side(2) = 20, reach = 1.5_real64, skin = 0.3_real64
   real(real64) :: energy = 0

contains

   ! Receives some thousand pairs at a time, always in the same order.
   subroutine add_springs(first, second, separation)
      integer(int32), intent(in) :: first(:), second(:)
      real(real64), intent(in) :: separation(:, :)
      integer :: k
      do k = 1, min(size(first), size(second))
         energy = energy + 0.5_real64*(1 - norm2(separation(:, k))/reach)**2
      end do
   end subroutine add_springs
end module springs

program neighbours
   use, intrinsic :: iso_fortran_env, only: int32, int64, real64
   use gamboge
   use springs
   implicit none
   type(gbg_context_t) :: context
   type(gbg_neighbours_t) :: search
   real(real64) :: x(2, discs)
   integer(int64), allocatable :: offset(:)
   integer(int32), allocatable :: neighbour(:)
   integer :: i, step, pairs, most, searches = 0
   logical :: searched = .false.

   call context%create('auto')
   x(1, :) = [(side(1)*mod(0.7548776662466927_real64*i, 1.0_real64), i=1, discs)]
   x(2, :) = [(side(2)*mod(0.5698402909980532_real64*i, 1.0_real64), i=1, discs)]

   call search%create(context, side, reach, 'verlet', skin)
   do step = 1, steps
      do i = 1, discs   ! your own dynamics
         x(1, i) = x(1, i) + 0.04_real64*(mod(0.6180339887498949_real64*i, 1.0_real64) - 0.5_real64)
      end do
      call search%update(x, searched)
      call search%visit(add_springs)
      if (searched) searches = searches + 1
   end do

   ! The same pairs as rows: neighbours of i are neighbour(offset(i):offset(i + 1) - 1).
   call search%get_count(pairs)
   call search%get_csr(offset, neighbour)

   most = int(maxval(offset(2:discs + 1) - offset(:discs)))
   print '(a,1x,i0)', 'pairs', pairs
   print '(a,1x,i0)', 'most_neighbours', most
   print '(a,1x,i0)', 'searches', searches
   print '(a,1x,f0.9)', 'mean_energy', energy/steps
end program neighbours
