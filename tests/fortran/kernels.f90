! The kernels on the caller's arrays against plain loops in double precision.
program kernels
   use, intrinsic :: iso_fortran_env, only: int64, real32, real64
   use checking, only: check, check_close, finish
   use gamboge
   implicit none
   integer, parameter :: n = 60
   real(real64), parameter :: sides(3) = [9.0_real64, 7.0_real64, 8.0_real64]
   type(gbg_context_t) :: context
   call context%create('cpu')
   call forces(2)
   call forces(3)
   call overlaps(2)
   call overlaps(3)
   call normals()
   call finish()

contains

   ! Points that follow from their index, some outside the box.
   pure function made(dimension, edges) result(x)
      integer, intent(in) :: dimension
      real(real64), intent(in) :: edges(:)
      real(real64) :: x(dimension, n)
      integer :: a, i
      do i = 1, n
         do a = 1, dimension
            x(a, i) = edges(a)*(modulo(0.6180339887498949_real64*i*a + 0.31_real64*a*i*i, 3.0_real64) - 1)
         end do
      end do
   end function made

   subroutine forces(dimension)
      integer, intent(in) :: dimension
      real(real64) :: edges(dimension), x(dimension, n), f(dimension, n), g(dimension, n), h(3, n)
      real(real64) :: alpha(n), mobility(n), zeros(n)
      real(real32) :: single(dimension, n)
      integer :: i
      edges = sides(:dimension)
      x = made(dimension, edges)
      alpha = [(1 + modulo(i, 2), i=1, n)]
      mobility = [(2 - modulo(i, 5), i=1, n)]
      zeros = 0
      call loop(edges, 2.0_real64, 0.0_real64, x, alpha, mobility, g)
      call gbg_pair_forces(context, edges, 2.0_real64, x, alpha, mobility, f, precision='double')
      call check_close(maxval(abs(f - g))/maxval(abs(g)), 0.0_real64, 1e-12_real64, 'double')
      call gbg_pair_forces(context, edges, 2.0_real64, x, alpha, mobility, f)
      call check_close(maxval(abs(f - g))/maxval(abs(g)), 0.0_real64, 1e-5_real64, 'mixed')
      h = 0
      if (dimension == 2) then
         call gbg_pair_forces(context, edges, 2.0_real64, x(1, :), x(2, :), alpha, mobility, &
                              h(1, :), h(2, :), precision='double')
      else
         call gbg_pair_forces(context, edges, 2.0_real64, x(1, :), x(2, :), x(3, :), alpha, &
                              mobility, h(1, :), h(2, :), h(3, :), precision='double')
      end if
      call check_close(maxval(abs(h(:dimension, :) - g))/maxval(abs(g)), 0.0_real64, 1e-12_real64, &
                       'separate')
      call gbg_pair_forces(context, real(edges), 2.0, real(x), real(alpha), real(mobility), single)
      call check_close(maxval(abs(single - g))/maxval(abs(g)), 0.0_real64, 1e-4_real64, 'single')
      call loop(edges, 3.0_real64, 2.5_real64, x, alpha, mobility, g)
      call gbg_pair_forces(context, edges, 3.0_real64, x, alpha, mobility, f, &
                           cutoff=2.5_real64, precision='double')
      call check_close(maxval(abs(f - g))/maxval(abs(g)), 0.0_real64, 1e-12_real64, 'cut off')
   end subroutine forces

   subroutine loop(edges, power, cutoff, x, alpha, mobility, f)
      real(real64), intent(in) :: edges(:), power, cutoff, x(:, :), alpha(:), mobility(:)
      real(real64), intent(out) :: f(:, :)
      real(real64) :: r(size(edges)), distance
      integer :: i, k
      f = 0
      do i = 1, n
         do k = 1, n
            if (k == i) cycle
            r = x(:, i) - x(:, k)
            r = r - edges*anint(r/edges)
            distance = norm2(r)
            if (cutoff > 0 .and. distance >= cutoff) cycle
            f(:, i) = f(:, i) + mobility(i)*alpha(k)*r/distance**(power + 1)
         end do
      end do
   end subroutine loop

   subroutine overlaps(dimension)
      integer, intent(in) :: dimension
      real(real64) :: edges(dimension), x(dimension, n), y(dimension, n), diameter(n), r(dimension)
      real(real32) :: single(dimension, n)
      integer :: first(500), second(500), count, pair, i, k, rounds, stat
      integer(int64) :: long_count
      edges = sides(:dimension)
      x = made(dimension, edges)
      diameter = [(0.7_real64 + 0.1_real64*modulo(i, 3), i=1, n)]
      first = 0
      call gbg_overlaps_find(context, edges, x, diameter, count, first, second)
      pair = 0
      do i = 1, n
         do k = i + 1, n
            r = x(:, i) - x(:, k)
            r = r - edges*anint(r/edges)
            if (norm2(r) >= (diameter(i) + diameter(k))/2) cycle
            pair = pair + 1
            call check(first(pair) == i .and. second(pair) == k, 'pairs are sorted and count from 1')
         end do
      end do
      call check(count == pair .and. pair > 0, 'number of overlaps')
      call gbg_overlaps_find(context, edges, x, diameter, long_count)
      call check(long_count == count, 'number of overlaps, int64')
      call gbg_overlaps_find(context, real(edges), real(x), real(diameter), count, tolerance=1e-5)
      call check(abs(count - pair) <= 1, 'number of overlaps, single precision')
      y = x
      call gbg_overlaps_remove(context, edges, y, diameter, max_rounds=1, stat=stat)
      call check(stat == gbg_e_step .and. maxval(abs(y - x)) <= 0, 'one round is not enough')
      call gbg_overlaps_remove(context, edges, y, diameter, rule='bounce', rounds=rounds)
      call check(rounds > 1, 'rounds')
      call gbg_overlaps_find(context, edges, y, diameter, count)
      call check(count == 0, 'none left')
      single = real(x)
      call gbg_overlaps_remove(context, real(edges), single, real(diameter))
      call gbg_overlaps_find(context, real(edges), single, real(diameter), count, tolerance=1e-5)
      call check(count == 0, 'none left in single precision beyond its rounding')
   end subroutine overlaps

   ! Moments, and the same numbers in every form and from any first id.
   subroutine normals()
      integer, parameter :: many = 20000
      real(real64), allocatable :: values(:, :)
      real(real64) :: part(2, 5), x(5), y(5)
      real(real32) :: single(2, 5)
      allocate (values(2, many))
      call gbg_normals(context, 4294967295_int64, 0, 10, 0, values)
      call check_close(sum(values)/size(values), 0.0_real64, 5/sqrt(2.0_real64*many), 'mean')
      call check_close(sum(values**2)/size(values), 1.0_real64, 5*sqrt(2/(2.0_real64*many)), &
                       'variance')
      call gbg_normals(context, 4294967295_int64, 0, 10_int64, 100, part)
      call check(maxval(abs(part - values(:, 101:105))) <= 0, 'from id 100')
      call gbg_normals(context, 4294967295_int64, 0, 10, 100, x, y)
      call check(maxval(abs(x - part(1, :)) + abs(y - part(2, :))) <= 0, 'separate')
      call gbg_normals(context, 4294967295_int64, 0, 10, 100, single)
      call check(maxval(abs(single - part)) <= 1e-6, 'single precision')
   end subroutine normals
end program kernels
