! Which base addresses and which step C is given for each layout: those of the caller's own array,
! so that nothing is copied, or those of a copy where one step cannot describe the arrays.
program addresses
   use, intrinsic :: iso_c_binding, only: c_associated, c_intptr_t, c_loc, c_ptr
   use, intrinsic :: iso_fortran_env, only: real32, real64
   use checking, only: check, check_text, finish
   use gamboge_c, only: gbg_e_argument, gbg_ok
   use gamboge_layout, only: drop, points, put_back, take
   implicit none

   real(real64), target :: flat(2, 10), deep(3, 10), tall(10, 2), line(30), none(2, 0)
   real(real64), target :: rx(10), ry(10), rz(10)
   real(real32), target :: single(3, 10)
   type(points) :: p
   common /body/ rx, ry, rz

   flat = 1
   deep = 2
   single = 3
   line = 4
   rx = 5
   ry = 6
   rz = 7

   call take(p, 'call', 2, flat)
   call expect('x(2,n) in 2D', 2, flat(1, 1), flat(2, 1))
   call take(p, 'call', 2, deep)
   call expect('x(3,n) in 2D', 3, deep(1, 1), deep(2, 1))
   call take(p, 'call', 3, deep)
   call expect('x(3,n) in 3D', 3, deep(1, 1), deep(2, 1), deep(3, 1))
   call take(p, 'call', 2, deep(1:2, :))
   call expect('x(1:2,:)', 3, deep(1, 1), deep(2, 1))
   call take(p, 'call', 2, deep(3:2:-1, :))
   call expect('rows in reverse', 3, deep(3, 1), deep(2, 1))
   call take(p, 'call', 3, deep(:, 2:10:3))
   call expect('every third column', 9, deep(1, 2), deep(2, 2), deep(3, 2))
   call take(p, 'call', 3, deep(:, 10:1:-1))
   call expect('columns in reverse', -3, deep(1, 10), deep(2, 10), deep(3, 10))
   call take(p, 'call', 2, rx, ry)
   call expect('COMMON rx, ry', 1, rx(1), ry(1))
   call take(p, 'call', 3, rx, ry, rz)
   call expect('COMMON rx, ry, rz', 1, rx(1), ry(1), rz(1))
   call take(p, 'call', 2, rx, ry, rz)
   call expect('rx, ry, rz in 2D', 1, rx(1), ry(1))
   call take(p, 'call', 2, tall(:, 1), tall(:, 2))
   call expect('x(n,2)', 1, tall(1, 1), tall(1, 2))
   call take(p, 'call', 2, line(1:10), line(11:20))
   call expect('x(2n) in blocks', 1, line(1), line(11))
   call take(p, 'call', 3, line(1::3), line(2::3), line(3::3))
   call expect('x(3n), one particle after the other', 3, line(1), line(2), line(3))
   call take(p, 'call', 3, rx(10:1:-1), ry(10:1:-1), rz(10:1:-1))
   call expect('separate and reversed', -1, rx(10), ry(10), rz(10))

   call take(p, 'call', 2, flat(:, 1:1))
   call check(c_associated(p%x, c_loc(flat)) .and. p%n == 1, 'one particle')
   call take(p, 'call', 2, none)
   call check(p%n == 0 .and. c_associated(p%x) .and. c_associated(p%y), 'no particle')

   call copies()
   call refusals()
   call finish()

contains

   ! n of the last call, base addresses and step are those of these elements.
   subroutine expect(what, step, x, y, z)
      character(*), intent(in) :: what
      integer, intent(in) :: step
      real(real64), intent(in), target :: x, y
      real(real64), intent(in), optional, target :: z
      call check(p%status == gbg_ok .and. .not. associated(p%buffer), what//': copied')
      call check(c_associated(p%x, c_loc(x)) .and. c_associated(p%y, c_loc(y)), what//': base')
      if (present(z)) then
         call check(c_associated(p%z, c_loc(z)), what//': base of z')
      else
         call check(.not. c_associated(p%z), what//': z is not NULL')
      end if
      call check(p%step == step, what//': step')
   end subroutine expect

   ! One step cannot describe these: a copy goes to C, and comes back when C wrote to it.
   subroutine copies()
      call take(p, 'call', 2, rx(1:5), ry(1:10:2))
      call check(associated(p%buffer), 'different strides: no copy')
      call check(c_associated(p%x, c_loc(p%buffer)) .and. p%step == 2, 'different strides: base')
      call check(all(abs(p%buffer(1, :) - 5) <= 0) .and. all(abs(p%buffer(2, :) - 6) <= 0), &
                 'different strides: values')
      p%buffer(2, :) = 8
      call put_back(p, rx(1:5), ry(1:10:2))
      call check(all(abs(ry(1:10:2) - 8) <= 0) .and. all(abs(ry(2:10:2) - 6) <= 0), &
                 'different strides: put back')
      call check(.not. associated(p%buffer), 'different strides: copy still there')
      call take(p, 'call', 2, single)
      call check(associated(p%buffer), 'single precision: no copy')
      call check(size(p%buffer, 1) == 2 .and. all(abs(p%buffer - 3) <= 0), &
                 'single precision: values')
      p%buffer = 9
      call put_back(p, single)
      call check(all(abs(single(:2, :) - 9) <= 0) .and. all(abs(single(3, :) - 3) <= 0), &
                 'single precision: put back, third row left alone')
      call take(p, 'call', 2, single)
      p%status = gbg_e_argument
      p%buffer = 1
      call put_back(p, single)
      call check(all(abs(single(:2, :) - 9) <= 0), 'after a refusal nothing is put back')
      call drop(p)
   end subroutine copies

   subroutine refusals()
      call take(p, 'call', 3, flat)
      call check(p%status == gbg_e_argument, 'x(2,n) in 3D')
      call check_text(p%problem, 'call: the array has shape (2,10) where (3,n) is needed', 'x(2,n)')
      call take(p, 'call', 2, tall)
      call check_text(p%problem, &
                      'call: the array has shape (10,2) where (2,n) or (3,n) is needed', 'x(n,2)')
      call take(p, 'call', 3, rx, ry)
      call check_text(p%problem, 'call: z is missing, needed in three dimensions', 'no z')
      call take(p, 'call', 2, rx, ry(:9))
      call check_text(p%problem, 'call: y has 9 elements for 10 particles', 'short y')
   end subroutine refusals
end program addresses
