// SPDX-License-Identifier: Apache-2.0
document.getElementById('page').textContent = 'asbuilt live';
