! L5, internal: turns Fortran arrays of coordinates into C's three base addresses and one step. No
! copy is made where one step can describe double-precision arrays; else a joined copy is described,
! and put_back returns what C wrote there.
module gamboge_layout
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_intptr_t, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: gbg_e_argument, gbg_ok
   implicit none
   private

   public :: take, put_back, drop, take_species, take_ids, match_size

   type, public :: points
      integer(int64) :: n = 0
      ! z is null in two dimensions
      type(c_ptr) :: x = c_null_ptr, y = c_null_ptr, z = c_null_ptr
      ! elements (8 bytes) from one particle to the next
      integer(c_intptr_t) :: step = 1
      ! the copy (dimension,n), when there has to be one
      real(real64), pointer :: buffer(:, :) => null()
      ! null without them
      type(c_ptr) :: species_at = c_null_ptr, ids_at = c_null_ptr
      ! their copies, when there have to be some
      integer(int32), pointer :: species(:) => null()
      integer(int64), pointer :: ids(:) => null()
      ! gbg_e_argument, with a sentence, when the shape cannot be coordinates
      integer(c_int) :: status = gbg_ok
      character(:), allocatable :: problem
   end type points

   ! take(p, call_name, dimension, x) or (..., x, y, z): describes the arrays in p. Dimension 0, of
   ! an object that was not created: no points, C will refuse the object.
   interface take
      module procedure take_matrix64, take_separate64, take_matrix32, take_separate32
   end interface take

   ! put_back(p, x) or (p, x, y, z): after a successful call, copies what C wrote to a copy into the
   ! caller's arrays; drops the copy.
   interface put_back
      module procedure put_matrix64, put_separate64, put_matrix32, put_separate32
   end interface put_back

   ! take_species(p, call_name, species): of each particle in p, after take; may be absent.
   interface take_species
      module procedure take_species32, take_species64
   end interface take_species

   integer(c_intptr_t), parameter :: element = storage_size(1.0_real64)/8

   ! What an array without elements points to: C is never handed NULL for a coordinate.
   real(c_double), target, save :: nothing = 0

contains

   ! x(2,n) or x(3,n) in any layout: whole, slice, stride, reversed. In two dimensions a third row
   ! is left alone.
   subroutine take_matrix64(p, call_name, dimension, x)
      type(points), intent(out) :: p
      character(*), intent(in) :: call_name
      integer, intent(in) :: dimension
      real(real64), intent(in), target :: x(:, :)
      if (refuse_shape(p, call_name, dimension, shape(x, int64))) return
      call describe(p, dimension, x)
   end subroutine take_matrix64

   ! x(n), y(n) and, in three dimensions, z(n): whole arrays, parts of a COMMON block, slices,
   ! components of a derived type.
   subroutine take_separate64(p, call_name, dimension, x, y, z)
      type(points), intent(out) :: p
      character(*), intent(in) :: call_name
      integer, intent(in) :: dimension
      real(real64), intent(in), target :: x(:), y(:)
      real(real64), intent(in), optional, target :: z(:)
      integer(c_intptr_t) :: bytes
      if (refuse_sizes(p, call_name, dimension, present(z), size(x, kind=int64), &
                       size(y, kind=int64))) return
      if (dimension == 3) call match_size(p, call_name, 'z', size(z, kind=int64))
      if (p%status /= gbg_ok .or. p%n == 0) return
      p%x = c_loc(x(1))
      p%y = c_loc(y(1))
      if (dimension == 3) p%z = c_loc(z(1))
      if (p%n == 1) return
      bytes = distance(c_loc(x(1)), c_loc(x(2)))
      p%step = bytes/element
      if (mod(bytes, element) == 0 .and. distance(c_loc(y(1)), c_loc(y(2))) == bytes) then
         if (dimension == 2) return
         if (distance(c_loc(z(1)), c_loc(z(2))) == bytes) return
      end if
      call join(p, dimension)
      p%buffer(1, :) = x
      p%buffer(2, :) = y
      if (dimension == 3) p%buffer(3, :) = z
   end subroutine take_separate64

   subroutine take_matrix32(p, call_name, dimension, x)
      type(points), intent(out) :: p
      character(*), intent(in) :: call_name
      integer, intent(in) :: dimension
      real(real32), intent(in) :: x(:, :)
      if (refuse_shape(p, call_name, dimension, shape(x, int64))) return
      call join(p, dimension)
      p%buffer = x(:dimension, :)
   end subroutine take_matrix32

   subroutine take_separate32(p, call_name, dimension, x, y, z)
      type(points), intent(out) :: p
      character(*), intent(in) :: call_name
      integer, intent(in) :: dimension
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in), optional :: z(:)
      if (refuse_sizes(p, call_name, dimension, present(z), size(x, kind=int64), &
                       size(y, kind=int64))) return
      if (dimension == 3) call match_size(p, call_name, 'z', size(z, kind=int64))
      if (p%status /= gbg_ok) return
      call join(p, dimension)
      p%buffer(1, :) = x
      p%buffer(2, :) = y
      if (dimension == 3) p%buffer(3, :) = z
   end subroutine take_separate32

   subroutine take_species32(p, call_name, species)
      type(points), intent(inout) :: p
      character(*), intent(in) :: call_name
      integer(int32), intent(in), optional, target :: species(:)
      if (.not. present(species)) return
      call match_size(p, call_name, 'species', size(species, kind=int64))
      if (p%status /= gbg_ok .or. p%n == 0) return
      p%species_at = c_loc(species(1))
      if (is_contiguous(species)) return
      allocate (p%species, source=species)
      p%species_at = c_loc(p%species)
   end subroutine take_species32

   subroutine take_species64(p, call_name, species)
      type(points), intent(inout) :: p
      character(*), intent(in) :: call_name
      integer(int64), intent(in) :: species(:)
      allocate (p%species, source=int(species, int32))
      call take_species32(p, call_name, p%species)
   end subroutine take_species64

   subroutine take_ids(p, call_name, ids)
      type(points), intent(inout) :: p
      character(*), intent(in) :: call_name
      integer(int64), intent(in), optional, target :: ids(:)
      if (.not. present(ids)) return
      call match_size(p, call_name, 'ids', size(ids, kind=int64))
      if (p%status /= gbg_ok .or. p%n == 0) return
      p%ids_at = c_loc(ids(1))
      if (is_contiguous(ids)) return
      allocate (p%ids, source=ids)
      p%ids_at = c_loc(p%ids)
   end subroutine take_ids

   subroutine put_matrix64(p, x)
      type(points), intent(inout) :: p
      real(real64), intent(inout) :: x(:, :)
      if (has_news(p)) x(:size(p%buffer, 1), :) = p%buffer
      call drop(p)
   end subroutine put_matrix64

   subroutine put_separate64(p, x, y, z)
      type(points), intent(inout) :: p
      real(real64), intent(inout) :: x(:), y(:)
      real(real64), intent(inout), optional :: z(:)
      if (has_news(p)) then
         x = p%buffer(1, :)
         y = p%buffer(2, :)
         if (size(p%buffer, 1) == 3) z = p%buffer(3, :)
      end if
      call drop(p)
   end subroutine put_separate64

   subroutine put_matrix32(p, x)
      type(points), intent(inout) :: p
      real(real32), intent(inout) :: x(:, :)
      if (has_news(p)) x(:size(p%buffer, 1), :) = real(p%buffer, real32)
      call drop(p)
   end subroutine put_matrix32

   subroutine put_separate32(p, x, y, z)
      type(points), intent(inout) :: p
      real(real32), intent(inout) :: x(:), y(:)
      real(real32), intent(inout), optional :: z(:)
      if (has_news(p)) then
         x = real(p%buffer(1, :), real32)
         y = real(p%buffer(2, :), real32)
         if (size(p%buffer, 1) == 3) z = real(p%buffer(3, :), real32)
      end if
      call drop(p)
   end subroutine put_separate32

   ! Was there a copy, and a successful call that wrote to it?
   pure logical function has_news(p)
      type(points), intent(in) :: p
      has_news = associated(p%buffer) .and. p%status == gbg_ok
   end function has_news

   ! Ends the use of p.
   subroutine drop(p)
      type(points), intent(inout) :: p
      if (associated(p%buffer)) deallocate (p%buffer)
      if (associated(p%species)) deallocate (p%species)
      if (associated(p%ids)) deallocate (p%ids)
   end subroutine drop

   ! Notes a problem when an array that goes with the particles has another size.
   subroutine match_size(p, call_name, name, has)
      type(points), intent(inout) :: p
      character(*), intent(in) :: call_name, name
      integer(int64), intent(in) :: has
      if (p%status /= gbg_ok .or. has == p%n) return
      call refuse(p, call_name//': '//name//' has '//decimal(has)//' elements for '// &
                  decimal(p%n)//' particles')
   end subroutine match_size

   ! Base addresses and step of a matrix that has a row an axis.
   subroutine describe(p, dimension, x)
      type(points), intent(inout) :: p
      integer, intent(in) :: dimension
      real(real64), intent(in), target :: x(:, :)
      if (p%n == 0) return
      p%x = c_loc(x(1, 1))
      p%y = c_loc(x(2, 1))
      if (dimension == 3) p%z = c_loc(x(3, 1))
      if (p%n > 1) p%step = distance(c_loc(x(1, 1)), c_loc(x(1, 2)))/element
   end subroutine describe

   ! Makes the copy and describes it.
   subroutine join(p, dimension)
      type(points), intent(inout) :: p
      integer, intent(in) :: dimension
      allocate (p%buffer(dimension, p%n))
      call describe(p, dimension, p%buffer)
   end subroutine join

   ! True when no array is to be described: the object does not exist, or the shape is refused.
   logical function refuse_shape(p, call_name, dimension, has)
      type(points), intent(inout) :: p
      character(*), intent(in) :: call_name
      integer, intent(in) :: dimension
      integer(int64), intent(in) :: has(2)
      refuse_shape = dimension == 0
      if (refuse_shape) return
      refuse_shape = has(1) < max(dimension, 2) .or. has(1) > 3
      if (refuse_shape) then
         call refuse(p, call_name//': the array has shape ('//decimal(has(1))//','// &
                     decimal(has(2))//') where '//trim(merge('(2,n) or (3,n)', '(3,n)         ', &
                     dimension == 2))//' is needed')
      end if
      call start(p, dimension, has(2))
   end function refuse_shape

   logical function refuse_sizes(p, call_name, dimension, has_z, n, n_y)
      type(points), intent(inout) :: p
      character(*), intent(in) :: call_name
      integer, intent(in) :: dimension
      logical, intent(in) :: has_z
      integer(int64), intent(in) :: n, n_y
      refuse_sizes = dimension == 0
      if (refuse_sizes) return
      call start(p, dimension, n)
      call match_size(p, call_name, 'y', n_y)
      if (dimension == 3 .and. .not. has_z) &
         call refuse(p, call_name//': z is missing, needed in three dimensions')
      refuse_sizes = p%status /= gbg_ok
   end function refuse_sizes

   ! n particles, so far without addresses of their own.
   subroutine start(p, dimension, n)
      type(points), intent(inout) :: p
      integer, intent(in) :: dimension
      integer(int64), intent(in) :: n
      p%n = n
      p%x = c_loc(nothing)
      p%y = c_loc(nothing)
      if (dimension == 3) p%z = c_loc(nothing)
   end subroutine start

   ! Bytes from a to b.
   function distance(a, b) result(bytes)
      type(c_ptr), intent(in) :: a, b
      integer(c_intptr_t) :: bytes
      bytes = transfer(b, 0_c_intptr_t) - transfer(a, 0_c_intptr_t)
   end function distance

   subroutine refuse(p, problem)
      type(points), intent(inout) :: p
      character(*), intent(in) :: problem
      p%status = gbg_e_argument
      p%problem = problem
   end subroutine refuse

   pure function decimal(number) result(text)
      integer(int64), intent(in) :: number
      character(:), allocatable :: text
      character(20) :: buffer
      write (buffer, '(i0)') number
      text = trim(buffer)
   end function decimal
end module gamboge_layout
