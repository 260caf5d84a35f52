! Neighbour search on arrays of every layout, against plain loops.
module neighbours_parts
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use checking, only: check, check_close
   use gamboge
   implicit none
   integer, parameter :: n = 200
   real(real64), parameter :: sides(3) = [9.0_real64, 7.0_real64, 8.0_real64]
   real(real64), parameter :: radius = 1.3_real64
   ! what the batches said, together
   integer :: batch_pairs
   real(real64) :: batch_sum, batch_longest

contains

   ! Points that follow from their index, some outside the box.
   pure function made(dimension) result(x)
      integer, intent(in) :: dimension
      real(real64) :: x(dimension, n)
      integer :: a, i
      do i = 1, n
         do a = 1, dimension
            x(a, i) = sides(a)*(modulo(0.6180339887498949_real64*i*a + 0.31_real64*a*i*i, 3.0_real64) - 1)
         end do
      end do
   end function made

   subroutine collect(first, second, separation)
      integer(int32), intent(in) :: first(:), second(:)
      real(real64), intent(in) :: separation(:, :)
      integer :: k
      do k = 1, size(first)
         batch_sum = batch_sum + norm2(separation(:, k))*(first(k) + 2*second(k))
         batch_longest = max(batch_longest, norm2(separation(:, k)))
      end do
      batch_pairs = batch_pairs + size(first)
   end subroutine collect

   ! The search against a double loop: pairs, rows and batches.
   subroutine results(search, x, what)
      type(gbg_neighbours_t), intent(in) :: search
      real(real64), intent(in) :: x(:, :)
      character(*), intent(in) :: what
      integer(int64), allocatable :: offset(:)
      integer(int32), allocatable :: neighbour(:), first(:), second(:)
      integer :: count, i, k, pair
      integer(int64) :: at(n + 1), long_count
      real(real64) :: r(size(x, 1)), total
      call search%get_count(count)
      call search%get_count(long_count)
      call search%get_pairs(first, second)
      call search%get_csr(offset, neighbour)
      at = offset
      pair = 0
      total = 0
      do i = 1, n
         do k = 1, n
            r = x(:, i) - x(:, k)
            r = r - sides(:size(x, 1))*anint(r/sides(:size(x, 1)))
            if (norm2(r) > radius .or. k == i) cycle
            call check(neighbour(at(i)) == k, what//': rows')
            at(i) = at(i) + 1
            if (k < i) cycle
            pair = pair + 1
            call check(first(pair) == i .and. second(pair) == k, what//': pairs')
            total = total + norm2(r)*(i + 2*k)
         end do
      end do
      call check(all(at(:n) == offset(2:n + 1)), what//': ends of rows')
      call check(count == pair .and. long_count == pair .and. pair > 0, what//': number of pairs')
      batch_pairs = 0
      batch_sum = 0
      batch_longest = 0
      call search%visit(collect)
      call check(batch_pairs == pair .and. batch_longest <= radius, what//': batches')
      call check_close(batch_sum/total, 1.0_real64, 1e-12_real64, what//': separations')
   end subroutine results

   subroutine layouts(context, dimension)
      type(gbg_context_t), intent(in) :: context
      integer, intent(in) :: dimension
      type(gbg_neighbours_t) :: search
      real(real64) :: x(dimension, n), transposed(n, dimension), wide(3, 2*n)
      real(real32) :: single(dimension, n)
      character(:), allocatable :: text
      real(real64) :: value
      x = made(dimension)
      transposed = transpose(x)
      wide = 0
      wide(:dimension, 2::2) = x
      call search%create(context, sides(:dimension), radius)
      call search%update(x)
      call results(search, x, 'x(2,n)')
      if (dimension == 2) then
         call search%update(transposed(:, 1), transposed(:, 2))
      else
         call search%update(transposed(:, 1), transposed(:, 2), transposed(:, 3))
      end if
      call results(search, x, 'x(n,2)')
      call search%update(wide(:dimension, 2::2))
      call results(search, x, 'every other column')
      call search%update(x(:, n:1:-1))
      call search%update(wide(:, 2::2))
      call results(search, x, 'three rows')
      if (dimension == 2) then
         call search%update(wide(1, 2::2), transposed(:, 2))
      else
         call search%update(wide(1, 2::2), transposed(:, 2), x(3, :))
      end if
      call results(search, x, 'different strides')
      single = real(x)
      x = single
      call search%update(single)
      call results(search, x, 'single precision')
      call search%describe(text)
      call check(index(text, 'grid') == 1, text)
      call search%get_statistic('updates', value)
      call check(nint(value) == 7, 'updates')
   end subroutine layouts

   subroutine methods(context)
      type(gbg_context_t), intent(in) :: context
      character(14), parameter :: names(8) = [character(14) :: 'grid', 'grid2', 'half', 'octant', &
         'octant:2.52', 'octant:4', 'brute', 'occupancy:1e-9']
      type(gbg_neighbours_t) :: search
      real(real64) :: x(2, n)
      logical :: searched
      integer :: k, stat, pairs
      character(200) :: message
      x = made(2)
      do k = 1, size(names) - 1
         call search%create(context, sides(:2), radius, method=names(k))
         call search%update(x)
         call results(search, x, names(k))
         call search%destroy()
      end do
      call search%create(context, sides(:2), radius, names(8))
      call search%update(x, stat=stat, errmsg=message)
      call check(stat == gbg_e_argument .and. index(message, 'take grid') > 0, message)
      call search%get_count(pairs, stat=stat)
      call check(stat == gbg_e_order, 'no pairs after a refusal')
      call search%destroy()
      call search%create(context, sides(:2), radius, 'verlet', skin=0.2_real64)
      call search%update(x, searched)
      call check(searched, 'the first update searches')
      x = x + 0.05_real64
      call search%update(x, searched)
      call check(.not. searched, 'the list is kept')
      call results(search, x, 'verlet')
      x(1, 5) = x(1, 5) + 0.06_real64
      call search%update(x, searched)
      call check(searched, 'the list is made again')
      call results(search, x, 'verlet')
      call search%destroy()
      call search%create(context, sides(:2), 3.6_real64, stat=stat, errmsg=message)
      call check(stat == gbg_e_argument .and. index(message, 'half the shortest') > 0, message)
      call search%update(x, stat=stat)
      call check(stat == gbg_e_argument, 'a search that was not created')
   end subroutine methods
end module neighbours_parts

program neighbours
   use checking, only: finish
   use neighbours_parts
   implicit none
   type(gbg_context_t) :: context
   call context%create('cpu')
   call layouts(context, 2)
   call layouts(context, 3)
   call methods(context)
   call finish()
end program neighbours
